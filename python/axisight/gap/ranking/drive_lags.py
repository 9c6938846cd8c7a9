"""Delays and lags of a drive, fitted until their fits end before they are held against one another.

They differ by little, and by less than fits leave open that are good enough for other rivals. A well damped
current loop is a delay up to the third power of frequency: it is begun there too, not only where a screen does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.effects import Effect, effect_info
from axisight.effects.stated import CURRENT_LOOP, TRANSPORT_DELAY
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.posterior import AxisPosterior, FittedHypothesis

# Of what the leader of an axis explains, which a lag may explain less and still end at as much.
_NEAR = 0.03
# Steps of a fit that is to end, and the loss that one more has to bring.
_STEPS = 12
_WORTH = 1.0
# Damping at which a current loop is most like a delay.
_AS_DELAY = float(np.sqrt(0.5))


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
    """Return fits of lags that have ended; of a current loop the better of two, one begun as the delay among them."""
    found = {one.hypothesis.effect.name: _ended(fitter, one.fitted) for one in lags}
    delay = found.get(TRANSPORT_DELAY[0])
    loop = found.get(CURRENT_LOOP[0])
    begun = None if delay is None else _as_delay(delay, options)
    if delay is not None and begun is not None and (loop is None or loop.total > delay.total):
        again = fitter.fit(begun, delay, fresh=True, max_iterations=_STEPS, worth=_WORTH)
        # Where no loop holds, what there is stays.
        if not isinstance(again, Diverged) and (loop is None or again.total < loop.total):
            found[CURRENT_LOOP[0]] = again
    return list(found.values())


def _ended(fitter: ModelFitter, fitted: FittedModel) -> FittedModel:
    found = fitter.fit(fitted.free, fitted, fresh=True, max_iterations=_STEPS, worth=_WORTH)
    return fitted if isinstance(found, Diverged) else found


def _as_delay(delay: FittedModel, options: Sequence[Hypothesis]) -> list[Hypothesis] | None:
    """Return a model with a current loop in the place of the delay that it ends with; None where none is tried."""
    name, time_constant, damping = CURRENT_LOOP
    effect = delay.effects[-1]
    late_s = effect.values()[0]
    shape = {time_constant: late_s / (2 * _AS_DELAY), damping: _AS_DELAY}
    loops = (o for o in options if (o.effect.name, o.effect.axis) == (name, effect.axis))
    return next(([*delay.free[:-1], loop.at(shape)] for loop in loops), None)
