"""Delays and lags of a drive, fitted until their fits end before they are held against one another.

They differ by little, and by less than fits leave open that are good enough for other rivals. A well damped
current loop is a delay up to the third power of frequency: it is begun there too, not only where a screen does.
"""

from __future__ import annotations

from collections.abc import Sequence

from axisight.effects import Effect, effect_info, effect_table
from axisight.effects.relations import Resembles
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior

# Of what the leader of an axis explains, which a lag may explain less and still end at as much.
_NEAR = 0.03
# Steps of a fit that is to end, and the loss that one more has to bring.
_STEPS = 12
_WORTH = 1.0


def lags_beside(standing: AxisPosterior) -> list[FittedHypothesis]:
    """Return the delays and lags of an axis that one of them leads on, as far as they are near it."""
    if not _is_of(standing.axis, standing.best.trial):
        return []
    least = standing.best.score - _NEAR
    return [r.trial for r in standing.ranked if r.score > least and _is_of(standing.axis, r.trial)]


def _is_of(axis: int, one: FittedHypothesis) -> bool:
    effect = one.hypothesis.effect
    return effect.axis == axis + 1 and is_lag(effect)


def is_lag(effect: Effect) -> bool:
    """Whether an effect is a delay or a lag of a drive."""
    return effect_info(effect.name).drive_lag


def ended(
    fitter: ModelFitter, lags: Sequence[FittedHypothesis], options: Sequence[Hypothesis]
) -> list[FittedModel]:
    """Return fits of lags that have ended; of one that is like another the better of two, one begun as that."""
    found = {one.hypothesis.effect.name: _ended(fitter, one.fitted) for one in lags}
    for info in effect_table().values():
        other = None if info.resembles is None else found.get(info.resembles.law)
        mine = found.get(info.name)
        if info.resembles is None or other is None:
            continue
        begun = _begun_as(other, info.name, info.resembles, options)
        if begun is None or (mine is not None and mine.total <= other.total):
            continue
        again = fitter.fit(begun, other, fresh=True, max_iterations=_STEPS, worth=_WORTH)
        # Where it does not hold, what there is stays.
        if not isinstance(again, Diverged) and (mine is None or again.total < mine.total):
            found[info.name] = again
    return list(found.values())


def _ended(fitter: ModelFitter, fitted: FittedModel) -> FittedModel:
    found = fitter.fit(fitted.free, fitted, fresh=True, max_iterations=_STEPS, worth=_WORTH)
    return fitted if isinstance(found, Diverged) else found


def _begun_as(
    other: FittedModel, name: str, like: Resembles, options: Sequence[Hypothesis]
) -> list[Hypothesis] | None:
    """Return a model with an effect in the place of the one that it is like, the last; None where none is tried."""
    effect = other.effects[-1]
    values = like.values(effect.values()[0])
    tried = (o for o in options if (o.effect.name, o.effect.axis) == (name, effect.axis))
    return next(([*other.free[:-1], one.at(values)] for one in tried), None)
