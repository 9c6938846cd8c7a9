"""Detection limits: the smallest amplitude of an effect that these logs would show.

A simulator that lacks an amplitude leaves a loss after every re-fit within its bounds. The effect is found if this loss
reaches the threshold for a cause in spite of noise. With ``s`` the mean square of the residual, a fall of the loss by
``d`` scatters by ``2 sqrt(d s)``.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.facts.result import DetectionLimit, Hidden
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.sensitivity import Sensitivity
from axisight.gap.ranking.fitted_hypothesis import numbers
from axisight.gap.ranking.likelihood import smallest_likely_fall
from axisight.gap.screening.screening import ScreeningModel, thinned
from axisight.gap.search.state import SearchState
from axisight.gap.views.view import View
from axisight.statistics.tails import normal_deviate

Array = NDArray[np.float64]

# Probability to find an amplitude at its limit.
_POWER = 0.95
# Range of the search, as factors of an effect's typical amplitude, and the relative precision of a limit.
_SPAN = (1e-5, 1e5)
_PRECISION = 0.02


def detection_limits(found: SearchState, view: View) -> tuple[DetectionLimit, ...]:
    """Return the limit of every effect that is no cause, at every place.

    It holds on the axis where the effect shows best, with all causes in the model. At the limit a gap is detected. To
    tell the effect from its look-alikes may need a larger amplitude. None for a search that its time limit stopped: it
    might have found larger ones, too.
    """
    if found.stopped is not None:
        return ()
    named = {e.label for e in found.model.effects}
    known = {**found.sensitivities, **_not_tried(found, view)}
    kept = [s for label, s in known.items() if label not in named]
    limits = []
    for s in sorted(kept, key=_order):
        shows = loss_that_shows(found, view.settings, numbers(s.option))
        limits.append(_limit(s, shows, view.fitter.tolerated(s.option.effect)))
    return tuple(limits)


def loss_that_shows(
    found: SearchState, settings: Settings, cost: float, more: Array | float = 1.0
) -> Array:
    """Return the loss on each axis (n_axes,) at which a missing effect shows with 95 % probability.

    ``cost``: number of its fitted parameters; ``more``: factor on the amount of data, by axis or for all.
    """
    loss = more * found.layout.by_axis(held_out_loss(found.model))
    samples = more * found.layout.samples()
    noise = np.maximum(loss, more * found.layout.by_axis(found.floor)) / samples
    least = more * np.maximum(found.least_falls(settings), settings.smallest_score * found.left())
    needed = np.maximum(least, smallest_likely_fall(loss, cost))
    sure = normal_deviate(1.0 - _POWER) * np.sqrt(noise)
    return np.asarray((sure + np.sqrt(sure**2 + needed)) ** 2)


def _not_tried(found: SearchState, view: View) -> dict[str, Sensitivity]:
    """Return the sensitivities of candidates on axes that the search did not try, since they had no gap."""
    tried = {s.option.effect.axis for s in found.sensitivities.values()}
    axes = [axis for axis in view.robot.axis_numbers() if axis not in tried]
    if not axes:
        return {}
    known = {*found.sensitivities, *(e.label for e in found.model.effects)}
    options = [
        o
        for o in view.candidates(found.model, axes=axes)
        if o.effect.label not in known and not o.effect.acts
    ]
    bench = ScreeningModel(view.fitter, found.model)
    screen = thinned(bench, held_out_loss(found.model) - found.floor, found.layout)
    with ThreadPoolExecutor(view.settings.threads) as pool:
        each = pool.map(screen.sensitivities, screen.groups(options))
        return {s.option.effect.label: s for group in each for s in group}


def _order(sensitivity: Sensitivity) -> tuple[str, int]:
    effect = sensitivity.option.effect
    return effect.name, effect.first_axis or 0


def _limit(s: Sensitivity, shows: Array, tolerated: float) -> DetectionLimit:
    """Return the limit of a candidate.

    ``shows`` (n_axes,): smallest loss that shows; ``tolerated``: size up to which the effect is within a tolerance.
    """
    effect = s.option.effect
    place = effect.first_axis
    info = next(p for p in effect_info(effect.name).parameters if p.name == s.parameter)
    names = (p.name for p in effect_info(effect.name).parameters)
    values = dict(zip(names, effect.values(), strict=True))
    others = {name: value for name, value in values.items() if name != s.parameter}
    largest = max(abs(info.lower), abs(info.upper))

    def missing(log_size: float) -> float:
        return float(np.max(np.sqrt(s.losses(float(np.exp(log_size))) / shows))) - 1.0

    low, high = np.log(info.typical * _SPAN[0]), np.log(min(largest, info.typical * _SPAN[1]))
    # Without a parameter at its bound, the root of the loss is proportional to the size; with one, it grows faster.
    with np.errstate(divide="ignore"):
        at_most = low - float(np.log1p(missing(low)))
    if at_most > high and missing(high) < 0.0:
        # The limit is larger than the effect can be: these logs do not show it at all.
        hidden = _hides(s, float(np.exp(high)), shows)
        return DetectionLimit(
            effect.name, place, s.parameter, None, info.unit, effect.axes, others, hidden
        )
    at_most = min(at_most, high)
    if at_most > low:
        bounded = missing(at_most) > _PRECISION
        low = scipy.optimize.brentq(missing, low, at_most, xtol=_PRECISION) if bounded else at_most
    size = float(np.exp(low))
    shown = _of_a_stiffer_gear(size) if "shows_inverse" in info.marks else size
    value = None if shown is None else max(shown, tolerated)
    why = _hides(s, size, shows) if value is None else None
    return DetectionLimit(
        effect.name, place, s.parameter, value, info.unit, effect.axes, others, why
    )


def _hides(s: Sensitivity, size: float, shows: Array) -> Hidden:
    """Return what hides an effect of this size: tolerances if it would show without compensation, else the motion."""
    return "tolerances" if np.any(s.unfitted(size) > shows) else "motion"


def _of_a_stiffer_gear(softer: float) -> float | None:
    """Return the relative increase of a stiffness for a relative decrease of its compliance; None from 0.5.

    Logs show the compliance, which can decrease by at most 1, to a rigid gear. No limit is given from half of that,
    where the stiffness doubles.
    """
    return None if softer >= 0.5 else softer / (1.0 - softer)
