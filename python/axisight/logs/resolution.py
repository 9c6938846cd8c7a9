"""Estimate the resolution of a channel around its jumps: encoder steps, or numbers with few digits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.logs.log import Floats

Ints = NDArray[np.int64]

# Samples on either side of a jump whose smallest changes of speed give the resolution.
_AROUND = 50
_SMALLEST = 0.1
ROUNDING = 1e-12
"""Differences below this share of the largest value are rounding errors."""
# Numbers of significant digits that count as few; more digits resolve any motion.
_DIGITS = range(3, 9)


def steps_around(values: Floats, places: Ints) -> Floats:
    """Return the resolution of a position (n,) between samples `k` and `k + 1`, for each `k` in `places`.

    If an encoder quantizes a position, its step per sample changes by at least one encoder step. Numbers
    written with few digits have steps that grow tenfold at every power of ten. The result is 0 if neither
    is visible.
    """
    if not places.size:
        return np.zeros(0)
    change = np.abs(np.diff(values, n=2))
    rounding = ROUNDING * float(np.abs(values).max())
    usual = _smallest(change, rounding)
    grid = np.array([_grid_step(change, int(k), rounding, usual) for k in places])
    return np.asarray(np.maximum(grid, _last_digit(values, places)))


def _grid_step(change: Floats, k: int, rounding: float, usual: float) -> float:
    """Return the smallest change of speed beside a jump, on the side where it is larger.

    If the axis rests on both sides, the result is `usual`, that of the whole channel.
    """
    before, after = change[max(0, k - 1 - _AROUND) : max(0, k - 1)], change[k + 1 : k + 1 + _AROUND]
    return max(_smallest(before, rounding), _smallest(after, rounding)) or usual


def _smallest(change: Floats, rounding: float) -> float:
    moving = change[change > rounding]
    return float(np.quantile(moving, _SMALLEST)) if moving.size else 0.0


def _last_digit(values: Floats, places: Ints) -> Floats:
    """Return the value of one unit in the last digit at each of `places`; 0 for numbers with many digits."""
    size = np.abs(values[values != 0.0])
    exponent = np.floor(np.log10(size))
    for digits in _DIGITS:
        scaled = size * 10.0 ** (digits - 1 - exponent)
        if np.abs(scaled - np.rint(scaled)).max() < 1e-5:
            largest = np.maximum(np.abs(values[places]), np.abs(values[places + 1]))
            largest = np.maximum(largest, size.min())
            return np.asarray(10.0 ** (np.floor(np.log10(largest)) + 1 - digits))
    return np.zeros(len(places))
