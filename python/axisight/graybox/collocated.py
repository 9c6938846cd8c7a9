"""The collocated response of one axis: motor torque to the acceleration of the same motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.frf.response import Flag

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_DERIVATIVES_MISSING = {"position": 2, "velocity": 1, "acceleration": 0}
_FEWEST_LINES = 8


@dataclass(frozen=True, eq=False)
class Collocated:
    """Lines of one axis that can be used.

    frequency_hz
        Ascending, (n,) [Hz].
    acceleration
        Torque to motor acceleration, complex (n,) [rad/s^2/Nm].
    variance
        E|dG|^2 of it, (n,); NaN where unknown.
    """

    frequency_hz: Real
    acceleration: Complex
    variance: Real

    @property
    def angular_rad_s(self) -> Real:
        """Angular frequencies [rad/s]."""
        return np.asarray(2 * np.pi * self.frequency_hz)

    def between(self, low_rad_s: float, high_rad_s: float) -> Collocated:
        """Return the lines from ``low_rad_s`` to ``high_rad_s``."""
        kept = (self.angular_rad_s >= low_rad_s) & (self.angular_rad_s <= high_rad_s)
        return Collocated(self.frequency_hz[kept], self.acceleration[kept], self.variance[kept])


def collocated(
    response: xr.Dataset,
    *,
    axis: int = 1,
    quantity: str | None = None,
    band_hz: tuple[float, float] | None = None,
) -> Collocated:
    """Return element (axis, axis) of a frequency response as torque to acceleration.

    Parameters
    ----------
    response : Dataset as the estimators of `axisight.frf` return, torque in and motor motion
        out; lines that are flagged or zero are left out.
    axis : the axis, from 1.
    quantity : what the output is, ``"position"``, ``"velocity"`` or ``"acceleration"``; None:
        what the Dataset says of itself, position if nothing.
    band_hz : lines outside are left out.

    Raises InputError for another Dataset, an axis it does not have, and fewer than eight lines.

    """
    if not isinstance(response, xr.Dataset) or "response" not in response:
        raise InputError(
            "response: expected a Dataset as the estimators of axisight.frf return, "
            f"got {type(response).__name__}"
        )
    for name in ("output", "input"):
        if axis not in response[name].values:
            known = ", ".join(str(a) for a in response[name].values)
            raise InputError(f"axis: expected one of {known}, got {axis!r}")
    quantity = quantity or str(response.attrs.get("quantity", "position"))
    if quantity not in _DERIVATIVES_MISSING:
        known = ", ".join(_DERIVATIVES_MISSING)
        raise InputError(f"quantity: expected one of {known}, got {quantity!r}")
    one = response.sel(output=axis, input=axis)
    frequency = np.asarray(one["frequency_hz"].values, np.float64)
    factor = (2j * np.pi * frequency) ** _DERIVATIVES_MISSING[quantity]
    value = one["response"].values * factor
    variance = one["variance"].values * np.abs(factor) ** 2
    flag = one["flag"].values if "flag" in one else np.zeros(len(frequency))
    kept = np.isfinite(value) & (value != 0) & (frequency > 0)
    kept &= np.isin(flag, (Flag.GOOD, Flag.ILL_CONDITIONED))
    if band_hz is not None:
        low, high = band_hz
        if not 0 <= low < high:
            raise InputError(f"band_hz: expected 0 <= low < high, got {band_hz}")
        kept &= (frequency >= low) & (frequency <= high)
    if kept.sum() < _FEWEST_LINES:
        raise InputError(
            f"response: expected at least {_FEWEST_LINES} lines that can be used, got {kept.sum()}"
        )
    return Collocated(frequency[kept], value[kept], variance[kept])


def sandwich(slope: Real, residual: Real) -> Real:
    """Covariance of a least-squares estimate from the scatter of each line (White 1980).

    ``slope`` and ``residual`` hold the real parts of all lines, then the imaginary ones; a line's
    two belong together. Right whatever the weights, which here are a compromise between noise
    and the errors of simple models. Scaled by n / (n - p) for the parameters fitted.
    """
    lines = len(residual) // 2
    inverse = np.linalg.pinv(slope.T @ slope, hermitian=True)
    scores = slope[:lines] * residual[:lines, None] + slope[lines:] * residual[lines:, None]
    scale = len(residual) / max(len(residual) - slope.shape[1], 1)
    covariance = scale * inverse @ (scores.T @ scores) @ inverse
    return np.asarray((covariance + covariance.T) / 2)
