"""Bristles that hold more than they slip with, begun where those that do not ended.

How friction falls once it slips shows only beside how it yields before: of all its numbers at once a fit ends in a
wrong valley, and what holds no more leaves a part that no other law mends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info
from axisight.effects.stated import BRISTLES, STRIBECK
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

# Share of the explainable error that bristles have to leave for how they break away to be looked for in it.
_LEAVES = 0.003
# By how much more they hold, to begin with, and at most.
_HOLDS = 1.3
_MOST = 5.0
_RATIO = "static_ratio"


def begun_sticking(
    standings: Sequence[AxisPosterior], options: Sequence[Hypothesis]
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return bristles that stick for axes that friction leads on, each with those it takes the place of.

    ``options``: all candidates; over which speeds Stribeck friction is looked for they are, too.
    """
    speed = STRIBECK[3]
    begun: list[tuple[FittedModel, Hypothesis]] = []
    for standing in standings:
        axis = standing.axis + 1
        bristles = _bristles(standing)
        falling = _named(options, Effect(STRIBECK[0], axis).label)
        if bristles is None or falling is None:
            continue
        fitted, yielding = bristles.trial.fitted, bristles.trial.hypothesis
        first = float((falling.effect.parameters or {})[speed])
        for over in sorted({first, *(s.get(speed, first) for s in falling.starts)}):
            option = replace(
                yielding,
                effect=fitted.effects[-1].with_values({_RATIO: _HOLDS, speed: over}),
                free=(*yielding.free, _RATIO, speed),
                bounds={
                    **yielding.bounds,
                    _RATIO: (1.0, _MOST),
                    speed: falling.bounds[speed],
                },
                starts=(),
            )
            begun.append((fitted, option))
    return begun


def _bristles(standing: AxisPosterior) -> RankedHypothesis | None:
    """Return bristles of an axis that friction of its own leads on, which do not stick and leave something."""
    label = Effect(BRISTLES[0], standing.axis + 1).label
    leader = standing.best.trial.hypothesis.effect
    leads = effect_info(leader.name).family == "friction" and leader.axis == standing.axis + 1
    if not leads:
        return None
    return next(
        (
            r
            for r in standing.ranked
            if r.trial.label == label
            and _RATIO not in r.trial.hypothesis.free
            and r.score < 1 - _LEAVES
        ),
        None,
    )


def _named(options: Sequence[Hypothesis], label: str) -> Hypothesis | None:
    return next((o for o in options if o.effect.label == label), None)
