"""Detection limits: the smallest amplitude of an effect that these logs would have shown.

A simulator that lacks an amplitude leaves a loss, however it is re-fitted within its bounds. The
effect is found where that is as much as a cause has to be worth, and noise does not take it below:
a loss ``d`` that falls scatters by ``2 sqrt(d s)``, with ``s`` the mean square of the residual.
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

# An amplitude at its limit is found with this probability.
_POWER = 0.95
# Sizes that are looked at, of the usual one, and how well a limit is found.
_SPAN = (1e-5, 1e5)
_PRECISION = 0.02


def detection_limits(found: SearchState, view: View) -> tuple[DetectionLimit, ...]:
    """Return the limit of every effect at every place that is no cause.

    On the axis where it shows best, with all causes in. Competition between effects that look alike
    is not in it: at the limit something is seen; what it is may need more.
    """
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
    """Return the loss on each axis (n_axes,) with which a missing effect shows, nineteen times of twenty.

    ``cost``: fitted numbers of it; ``more``: times as much data as there are, of each axis or of all.
    """
    loss = more * found.layout.by_axis(held_out_loss(found.model))
    samples = more * found.layout.samples()
    noise = np.maximum(loss, more * found.layout.by_axis(found.floor)) / samples
    least = more * np.maximum(found.least_falls(settings), settings.smallest_score * found.left())
    needed = np.maximum(least, smallest_likely_fall(loss, cost))
    sure = normal_deviate(1.0 - _POWER) * np.sqrt(noise)
    return np.asarray((sure + np.sqrt(sure**2 + needed)) ** 2)


def _not_tried(found: SearchState, view: View) -> dict[str, Sensitivity]:
    """Return the sensitivities of candidates on axes where nothing was to be explained."""
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

    ``shows`` (n_axes,): loss that is seen; ``tolerated``: change of the quantity that is scatter.
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
    # Where no parameter meets its bound what is missing grows as the size does; where one does, faster.
    with np.errstate(divide="ignore"):
        at_most = low - float(np.log1p(missing(low)))
    if at_most > high and missing(high) < 0.0:
        # Larger than the effect can be: these logs do not show it at all.
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
    """Return what hides a size of an effect: whether it would show while nothing makes up for it."""
    return "tolerances" if np.any(s.unfitted(size) > shows) else "motion"


def _of_a_stiffer_gear(softer: float) -> float | None:
    """Return the relative change of a stiffness that a relative change of its compliance is.

    That is what shows, and a gear that gives nothing at all is the most of it: None where twice the
    change would be more.
    """
    return None if softer >= 0.5 else softer / (1.0 - softer)
