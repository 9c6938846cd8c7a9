"""Full fits of delays and lags of a drive before they are compared.

Their losses differ by less than the stopping tolerance of other fits. A well damped current loop equals a delay up to
the third power of frequency, so its fit also starts from the fitted delay.
"""

from __future__ import annotations

from collections.abc import Sequence

from axisight.effects import Effect, effect_info, effect_table
from axisight.effects.relations import Resembles
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import RENEWALS
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior

# Most steps of a full fit, and the fall of the loss below which it ends.
_STEPS = 12
_WORTH = 1.0


def lags_beside(standing: AxisPosterior) -> list[FittedHypothesis]:
    """Return the delays and lags in reach of the leader of an axis; none unless a delay or lag of the axis leads."""
    if not _is_of(standing.axis, standing.best.trial):
        return []
    return [
        r.trial for r in standing.ranked if _is_of(standing.axis, r.trial) and standing.in_reach(r)
    ]


def _is_of(axis: int, one: FittedHypothesis) -> bool:
    effect = one.hypothesis.effect
    return effect.axis == axis + 1 and is_lag(effect)


def is_lag(effect: Effect) -> bool:
    """Whether an effect is a delay or a lag of a drive."""
    return effect_info(effect.name).drive_lag


def ended(
    fitter: ModelFitter, lags: Sequence[FittedHypothesis], options: Sequence[Hypothesis]
) -> list[FittedModel]:
    """Return full fits of the lags. A lag that resembles another also starts from it; the better fit counts."""
    found = {one.hypothesis.effect.name: _ended(fitter, one.fitted) for one in lags}
    for info in effect_table().values():
        other = None if info.resembles is None else found.get(info.resembles.law)
        mine = found.get(info.name)
        if info.resembles is None or other is None:
            continue
        begun = _begun_as(other, info.name, info.resembles, options)
        if begun is None or (mine is not None and mine.total <= other.total):
            continue
        again = fitter.fit(begun, other, refreshes=RENEWALS, max_iterations=_STEPS, worth=_WORTH)
        # If it diverges, the fit from the first start stays.
        if not isinstance(again, Diverged) and (mine is None or again.total < mine.total):
            found[info.name] = again
    return list(found.values())


def _ended(fitter: ModelFitter, fitted: FittedModel) -> FittedModel:
    if fitted.renewed and linear_gain(fitted) < _WORTH:
        return fitted
    found = fitter.fit(fitted.free, fitted, refreshes=RENEWALS, max_iterations=_STEPS, worth=_WORTH)
    return fitted if isinstance(found, Diverged) else found


def _begun_as(
    other: FittedModel, name: str, like: Resembles, options: Sequence[Hypothesis]
) -> list[Hypothesis] | None:
    """Return the hypotheses with the last one replaced by the effect that resembles it; None if it is not offered."""
    effect = other.effects[-1]
    values = like.values(effect.values()[0])
    tried = (o for o in options if (o.effect.name, o.effect.axis) == (name, effect.axis))
    return next(([*other.free[:-1], one.at(values)] for one in tried), None)
