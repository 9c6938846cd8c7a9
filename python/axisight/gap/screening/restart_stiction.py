"""Bristles that hold more than they slip with, begun where those that do not ended.

How friction falls once it slips shows only beside how it yields before: of all its numbers at once a fit ends in a
wrong valley, and what holds no more leaves a part that no other law mends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info, effect_table
from axisight.effects.relations import Later
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

# Share of the explainable error that bristles have to leave for how they break away to be looked for in it.
_LEAVES = 0.003


def begun_sticking(
    standings: Sequence[AxisPosterior], options: Sequence[Hypothesis]
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return bristles that stick for axes that friction leads on, each with those it takes the place of.

    And whatever else has numbers that are looked for later. ``options``: all candidates; over which speeds
    Stribeck friction is looked for they are, too.
    """
    sticking = [(info.name, info.later) for info in effect_table().values() if info.later]
    begun: list[tuple[FittedModel, Hypothesis]] = []
    for standing in standings:
        for name, later in sticking:
            yielding = _yielding(standing, name, later)
            falling = _named(options, Effect(later.as_of, standing.axis + 1).label)
            if yielding is not None and falling is not None:
                fitted = yielding.trial.fitted
                of_law = _sticking(yielding.trial.hypothesis, fitted.effects[-1], later, falling)
                begun += [(fitted, option) for option in of_law]
    return begun


def _sticking(
    yielding: Hypothesis, fitted: Effect, later: Later, falling: Hypothesis
) -> list[Hypothesis]:
    """Return a law with its later numbers free, begun at each shape at which a like one is."""
    ratio, speed = later.amplitude, later.shape
    least = next(p.neutral for p in effect_info(fitted.name).parameters if p.name == ratio)
    first = float((falling.effect.parameters or {})[speed])
    return [
        replace(
            yielding,
            effect=fitted.with_values({ratio: later.begin, speed: over}),
            free=(*yielding.free, ratio, speed),
            bounds={
                **yielding.bounds,
                ratio: (least, later.most),
                speed: falling.bounds[speed],
            },
            starts=(),
        )
        for over in sorted({first, *(s.get(speed, first) for s in falling.starts)})
    ]


def _yielding(standing: AxisPosterior, name: str, later: Later) -> RankedHypothesis | None:
    """Return a law of an axis that a law of its family leads on, without its later numbers, which leaves something."""
    label = Effect(name, standing.axis + 1).label
    leader = standing.best.trial.hypothesis.effect
    alike = effect_info(leader.name).family == effect_info(name).family
    if not alike or leader.axis != standing.axis + 1:
        return None
    return next(
        (
            r
            for r in standing.ranked
            if r.trial.label == label
            and later.amplitude not in r.trial.hypothesis.free
            and r.score < 1 - _LEAVES
        ),
        None,
    )


def _named(options: Sequence[Hypothesis], label: str) -> Hypothesis | None:
    return next((o for o in options if o.effect.label == label), None)
