"""Penalised B-splines on the range of the data (Eilers and Marx 1996, Statistical Science 11(2))."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DEGREE = 3
# Intervals between knots: features of a tenth of the range show.
_INTERVALS = 10
# Points of a function's table; a cubic spline of ten intervals is linear between them to 0.3 %.
_POINTS = 61
# Share of the samples beyond each end of the range; a spline has too few data there.
_BEYOND = 0.002
# Share of the constant in the penalty, so that every system of equations has one solution.
_RIDGE = 1e-2


@dataclass(frozen=True)
class Scale:
    """The range of a variable that the data cover, and its scale.

    ``corner``: value above which the scale is logarithmic; None for an even scale. ``period``: the function repeats
    after it; None if it does not. Values beyond the range count as its nearest end.
    """

    low: float
    high: float
    corner: float | None = None
    period: float | None = None

    def __call__(self, x: Array) -> Array:
        """Return values (n,) as places from 0 to 1."""
        if self.period is not None:
            return np.asarray(np.mod(x, self.period) / self.period)
        ends = self._warped(np.array([self.low, self.high]))
        place = (self._warped(np.clip(x, self.low, self.high)) - ends[0]) / (ends[1] - ends[0])
        return np.asarray(np.clip(place, 0.0, 1.0))

    def points(self) -> Array:
        """Return the values (m,) at which a function is tabulated."""
        place = np.linspace(0.0, 1.0, _POINTS)
        if self.period is not None:
            return place * self.period
        ends = self._warped(np.array([self.low, self.high]))
        warped = ends[0] + place * (ends[1] - ends[0])
        return warped if self.corner is None else np.asarray(self.corner * np.sinh(warped))

    def _warped(self, x: Array) -> Array:
        return x if self.corner is None else np.asarray(np.arcsinh(x / self.corner))


def scale_of(x: Array, warp: float | None, period: float | None = None) -> Scale | None:
    """Return the scale of a variable from its values (n,); None if it is not known or does not vary."""
    if not np.all(np.isfinite(x)):
        return None
    low, high = np.quantile(x, [_BEYOND, 1 - _BEYOND])
    size = float(np.abs(x).max())
    if high - low <= 1e-9 * max(size, 1e-300):
        return None
    return Scale(float(low), float(high), None if warp is None else warp * size, period)


def basis(scale: Scale, x: Array) -> Array:
    """Return the B-splines (n, m) at values (n,)."""
    step = 1.0 / _INTERVALS
    knots = step * np.arange(-_DEGREE, _INTERVALS + _DEGREE + 1)
    made = scipy.interpolate.BSpline.design_matrix(scale(x), knots, _DEGREE).toarray()
    if scale.period is None:
        return np.asarray(made)
    # The last splines go round to the first ones.
    made[:, :_DEGREE] += made[:, -_DEGREE:]
    return np.asarray(made[:, :-_DEGREE])


def penalty(scale: Scale) -> Array:
    """Return the penalty of the spline coefficients (m, m): squared second differences."""
    count = _INTERVALS + (0 if scale.period is not None else _DEGREE)
    if scale.period is None:
        second = np.diff(np.eye(count), 2, axis=0)
    else:
        one = np.eye(count)
        second = np.roll(one, 1, axis=0) - 2 * one + np.roll(one, -1, axis=0)
    return np.asarray(second.T @ second + _RIDGE * np.eye(count))
