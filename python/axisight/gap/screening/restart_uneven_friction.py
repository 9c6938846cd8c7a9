"""Starts position-dependent friction from the fit of dry friction that is the same at every angle.

The wave of position-dependent friction is estimated from the residual of a model. While that residual still holds all
dry friction and other errors, the estimate may be wrong and the fit ends in a local minimum. A law that contains
another can fit no worse than the contained one, so a worse fit is repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from axisight.effects import Effect, effect_table
from axisight.effects.relations import BegunFrom
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior

# Smallest share of the explainable error that uniform friction must leave before position-dependent friction is fitted.
_LEAVES = 0.01


def begun_wider(
    standings: Sequence[AxisPosterior],
    trials: Sequence[FittedHypothesis],
    offered: Callable[[FittedModel], Sequence[Hypothesis]],
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return restarts with position-dependent friction for axes that uniform friction leads.

    Each with the model whose last effect it replaces. The same holds for every effect whose table entry names a law
    that it begins from. A candidate whose fit is already as good as the contained law is left out. ``offered``: returns
    candidates for the residual of a model.
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
                out += [
                    (even.fitted, option.at(_from_uniform(effect, begun))) for option in options
                ]
    return out


def _from_uniform(even: Effect, begun: BegunFrom) -> dict[str, float]:
    """Return the values that position-dependent friction takes over from uniform friction."""
    values = even.parameters or {}
    return {taken: values[name] for name, taken in begun.takes.items() if name in values}
