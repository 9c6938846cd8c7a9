"""Starts a law of friction from the fit of a plainer law that it contains.

Its start values are estimated from the residual of a model. While that residual still holds all dry friction and other
errors, the estimate may be wrong and the fit ends in a local minimum. A law that contains another can fit no worse than
the contained one, so a fit that gains nothing by its further numbers is repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from axisight.effects import Effect, effect_table
from axisight.effects.relations import BegunFrom
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior

# Smallest share of the explainable error that the plainer law must leave before a wider one is fitted, and smallest
# share of the plainer law's loss that a wider fit must remove to count.
_LEAVES = 0.01


def begun_wider(
    standings: Sequence[AxisPosterior],
    trials: Sequence[FittedHypothesis],
    offered: Callable[[FittedModel], Sequence[Hypothesis]],
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return restarts with wider laws for axes that a plainer law leads.

    Each comes with the model whose last effect it replaces. The table of effects names the law that an effect begins
    from. A candidate that already fits better than that law is left out. ``offered``: returns candidates for the
    residual of a model.
    """
    known = {t.label: t for t in trials}
    wider = [(info.name, info.begun_from) for info in effect_table().values() if info.begun_from]
    out: list[tuple[FittedModel, Hypothesis]] = []
    for standing in standings:
        plain = standing.best.trial
        effect = plain.fitted.effects[-1]
        if effect.axis != standing.axis + 1 or standing.best.score > 1 - _LEAVES:
            continue
        for name, begun in wider:
            label = Effect(name, effect.axis).label
            gains = (
                label in known and known[label].fitted.total < (1 - _LEAVES) * plain.fitted.total
            )
            if effect.name == begun.law and not gains:
                options = (o for o in offered(plain.fitted) if o.effect.label == label)
                taken = _taken_over(effect, begun)
                out += [
                    (plain.fitted, option.at({**start, **taken}))
                    for option in options
                    for start in ({}, *option.starts)
                ]
    return out


def _taken_over(plain: Effect, begun: BegunFrom) -> dict[str, float]:
    """Return the values that a wider law takes over from a plainer one."""
    values = plain.parameters or {}
    return {taken: values[name] for name, taken in begun.takes.items() if name in values}
