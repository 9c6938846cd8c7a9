"""Starts stiction (break-away torque above sliding friction) from the fit of pre-sliding friction without it.

How friction falls after break-away shows only beside correct pre-sliding. A fit of all parameters at once ends in a
local minimum. Without stiction, an error stays that no other law can remove.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info, effect_table
from axisight.effects.relations import Later
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

# Smallest share of the explainable error that pre-sliding friction must leave before stiction is fitted.
_LEAVES = 0.003


def begun_sticking(
    standings: Sequence[AxisPosterior], options: Sequence[Hypothesis]
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return restarts with stiction for axes that friction leads, each with the model whose last effect is replaced.

    The same holds for every law whose table entry has parameters to be fitted ``later``. ``options``: all candidates.
    The range of speeds over which friction falls is taken from the Stribeck candidate.
    """
    sticking = [(info.name, info.later) for info in effect_table().values() if info.later]
    begun: list[tuple[FittedModel, Hypothesis]] = []
    for standing in standings:
        for name, later in sticking:
            yielding = _law_without_stiction(standing, name, later)
            falling = _named(options, Effect(later.as_of, standing.axis + 1).label)
            if yielding is not None and falling is not None:
                fitted = yielding.trial.fitted
                of_law = _with_stiction(
                    yielding.trial.hypothesis, fitted.effects[-1], later, falling
                )
                begun += [(fitted, option) for option in of_law]
    return begun


def _with_stiction(
    yielding: Hypothesis, fitted: Effect, later: Later, falling: Hypothesis
) -> list[Hypothesis]:
    """Return a law with its later parameters free, once for each start value of the shape that ``falling`` has."""
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


def _law_without_stiction(
    standing: AxisPosterior, name: str, later: Later
) -> RankedHypothesis | None:
    """Return the fitted law ``name`` without its later parameters, if a law of its family leads the axis; else None.

    None also if it leaves too little of the error.
    """
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
