"""Evidence from the numbers: the unit of the time, and how position, velocity and torque correlate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from axisight.errors import InputError
from axisight.logs.filters import differentiate, lowpass
from axisight.logs.guessing.series import Series
from axisight.logs.log import Floats
from axisight.logs.unit_guess import velocity_ratio
from axisight.logs.units import si_factor

# Sample rates that logs of robots have.
_RATES_HZ = (2.0, 20_000.0)
_TIME_UNITS = ("s", "ms", "us", "ns")
_ALIKE = 0.9
# The closest factors of two pairs of units are 4.7 % apart; if one unit is known, factors are far apart.
PAIRS_APART = 0.02
UNITS_APART = 0.05
_BAND_HZ = 10.0
# A joint in rad stays within this range; larger values are degrees or motor-side.
LARGEST_JOINT_RAD = 7.0
LARGEST_JOINT_DEG = 720.0


def increases(values: Floats) -> bool:
    """Whether a time (n,) is finite and increases with every sample."""
    return values.size > 2 and bool(np.isfinite(values).all() and (np.diff(values) > 0).all())


def time_units(values: Floats) -> list[str]:
    """Return the units in which an increasing time (n,) has a plausible sample rate, lowest rate first."""
    step = float(np.median(np.diff(values)))
    low, high = _RATES_HZ
    return [unit for unit in _TIME_UNITS if low <= 1.0 / (step * si_factor(unit)) <= high]


@dataclass(frozen=True)
class Agreement:
    """How well velocities follow the derivatives of positions, over the axes that move.

    ``ratio`` is the median of velocity / derivative over the axes, in the units of the file. ``alike`` is the
    correlation with the smallest size. ``axes`` counts the axes that could be compared.
    """

    ratio: float
    alike: float
    axes: int

    @property
    def clear(self) -> bool:
        """Whether the velocities are the derivatives up to a factor."""
        return self.axes > 0 and abs(self.alike) >= _ALIKE

    def is_factor(self, factor: float, within: float) -> bool:
        """Whether the velocities are the derivatives times ``factor``, within a relative error ``within``."""
        return self.clear and abs(self.ratio / factor - 1.0) <= within


def agreement(
    positions: Sequence[Series], velocities: Sequence[Series], sample_time_s: float
) -> Agreement:
    """Return how velocities (n,) agree with positions (n,) over the axes that move and have no NaN."""
    ratios, alike = [], []
    for position, velocity in zip(positions, velocities, strict=True):
        if not (np.isfinite(position.values).all() and np.isfinite(velocity.values).all()):
            continue
        try:
            ratio, correlation = velocity_ratio(position.values, velocity.values, sample_time_s)
        except InputError:  # too short for a filter
            continue
        if correlation != 0.0:
            ratios.append(ratio)
            alike.append(correlation)
    if not ratios:
        return Agreement(math.nan, 0.0, 0)
    worst = alike[int(np.argmin(np.abs(alike)))]
    return Agreement(float(np.median(ratios)), worst, len(ratios))


def follows_acceleration(
    positions: Sequence[Series], torques: Sequence[Series], sample_time_s: float
) -> list[float]:
    """Return the correlation of torque with acceleration for each axis that can be compared."""
    found = []
    cutoff = min(_BAND_HZ, 0.2 / sample_time_s)
    for position, torque in zip(positions, torques, strict=True):
        if not (np.isfinite(position.values).all() and np.isfinite(torque.values).all()):
            continue
        try:
            _, acceleration = differentiate(position.values, sample_time_s, cutoff)
            smooth = lowpass(torque.values, sample_time_s, cutoff)
        except InputError:
            continue
        a, b = acceleration - acceleration.mean(), smooth - smooth.mean()
        scale = math.sqrt(float(a @ a) * float(b @ b))
        if scale > 0.0:
            found.append(float(a @ b) / scale)
    return found


def largest(signals: Sequence[Series]) -> float:
    """Return the largest absolute value of all signals; 0 if none is finite."""
    sizes = [np.abs(s.values[np.isfinite(s.values)]).max(initial=0.0) for s in signals]
    return float(max(sizes, default=0.0))
