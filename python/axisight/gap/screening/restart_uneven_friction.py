"""Dry friction that changes with the angle, begun where friction which is the same everywhere ended.

Its wave is looked for in what is left of a model. While all of dry friction is left, beside a gap elsewhere, the
wave found may be another's, and the fit ends in its valley; a law that holds another cannot leave more than it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from axisight.effects import Effect, effect_table
from axisight.effects.relations import BegunFrom
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior

# Share of the explainable error that even friction has to leave for another law to be looked for in it.
_LEAVES = 0.01


def begun_wider(
    standings: Sequence[AxisPosterior],
    trials: Sequence[FittedHypothesis],
    offered: Callable[[FittedModel], Sequence[Hypothesis]],
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return uneven friction for axes that even friction leads on, each with the model it takes the place in.

    And whatever else begins from the law that leads. ``offered``: candidates for what is left of a model.
    """
    known = {t.label: t for t in trials}
    wider = [(info.name, info.begun_from) for info in effect_table().values() if info.begun_from]
    out: list[tuple[FittedModel, Hypothesis]] = []
    for standing in standings:
        even = standing.best.trial
        effect = even.fitted.effects[-1]
        if effect.axis != standing.axis + 1 or standing.best.score > 1 - _LEAVES:
            continue
        for name, begun in wider:
            label = Effect(name, effect.axis).label
            tried = label in known and known[label].fitted.total <= even.fitted.total
            if effect.name == begun.law and not tried:
                options = (o for o in offered(even.fitted) if o.effect.label == label)
                out += [(even.fitted, option.at(_as_even(effect, begun))) for option in options]
    return out


def _as_even(even: Effect, begun: BegunFrom) -> dict[str, float]:
    """Return what uneven friction takes over from one that is the same everywhere."""
    values = even.parameters or {}
    return {taken: values[name] for name, taken in begun.takes.items() if name in values}
