"""Dry friction that changes with the angle, begun where friction which is the same everywhere ended.

Its wave is looked for in what is left of a model. While all of dry friction is left, beside a gap elsewhere, the
wave found may be another's, and the fit ends in its valley; a law that holds another cannot leave more than it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from axisight.effects import Effect
from axisight.effects.stated import BEHIND_GEAR, DRY_FRICTION, UNEVEN
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.posterior import AxisPosterior, FittedHypothesis

# Share of the explainable error that even friction has to leave for another law to be looked for in it.
_LEAVES = 0.01


def begun_wider(
    standings: Sequence[AxisPosterior],
    trials: Sequence[FittedHypothesis],
    offered: Callable[[FittedModel], Sequence[Hypothesis]],
) -> list[tuple[FittedModel, Hypothesis]]:
    """Return uneven friction for axes that even friction leads on, each with the model it takes the place in.

    ``offered``: candidates for what is left of a model.
    """
    known = {t.label: t for t in trials}
    out: list[tuple[FittedModel, Hypothesis]] = []
    for standing in standings:
        even = standing.best.trial
        effect = even.fitted.effects[-1]
        mine = effect.name == DRY_FRICTION[0] and effect.axis == standing.axis + 1
        if not mine or standing.best.score > 1 - _LEAVES:
            continue
        label = Effect(UNEVEN[0], effect.axis).label
        if label in known and known[label].fitted.total <= even.fitted.total:
            continue
        options = (o for o in offered(even.fitted) if o.effect.label == label)
        out += [(even.fitted, option.at(_as_even(effect))) for option in options]
    return out


def _as_even(even: Effect) -> dict[str, float]:
    """Return what uneven friction takes over from one that is the same everywhere."""
    values = even.parameters or {}
    _, size, corner = DRY_FRICTION
    side = {BEHIND_GEAR: values[BEHIND_GEAR]} if BEHIND_GEAR in values else {}
    return {UNEVEN[1]: values[size], corner: values[corner], **side}
