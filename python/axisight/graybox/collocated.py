"""The collocated response of one axis: motor torque to the acceleration of the same motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import digamma

from axisight.errors import InputError
from axisight.frf.quantity import quantity_of
from axisight.frf.response import Flag

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_DERIVATIVES_MISSING = {"position": 2, "velocity": 1, "acceleration": 0}
_FEWEST_LINES = 8
# Degrees of freedom that make a variance a weight: its standard deviation is then a third.
_ENOUGH_FREEDOM = 10.0
# Relative error of a response up to which simple models are not told from it.
_MODEL_FLOOR = 0.05
_DECIDED = 1e-8


@dataclass(frozen=True, eq=False)
class Collocated:
    """Lines of one axis that can be used.

    frequency_hz
        Ascending, (n,) [Hz].
    acceleration
        Torque to motor acceleration, complex (n,) [rad/s^2/Nm].
    variance
        E|dG|^2 of it, (n,); NaN where unknown.
    degrees_of_freedom
        Complex, of the variance, (n,); infinite where it is known exactly, as it is taken to be
        by default.
    """

    frequency_hz: Real
    acceleration: Complex
    variance: Real
    degrees_of_freedom: Real | None = None

    @property
    def angular_rad_s(self) -> Real:
        """Angular frequencies [rad/s]."""
        return np.asarray(2 * np.pi * self.frequency_hz)

    def between(self, low_rad_s: float, high_rad_s: float) -> Collocated:
        """Return the lines from ``low_rad_s`` to ``high_rad_s``."""
        kept = (self.angular_rad_s >= low_rad_s) & (self.angular_rad_s <= high_rad_s)
        return self.lines(kept)

    def lines(self, kept: NDArray[np.bool_]) -> Collocated:
        """Return the lines that ``kept`` (n,) says."""
        freedom = self.degrees_of_freedom
        return Collocated(
            self.frequency_hz[kept],
            self.acceleration[kept],
            self.variance[kept],
            None if freedom is None else freedom[kept],
        )

    def noise(self, modelled: Complex | Real) -> Real:
        """Return the variance relative to the squared ``modelled`` response (n,), zero if unknown.

        A variance from few periods scatters so much that chance would choose the lines: below
        ten degrees of freedom its geometric mean with those of neighbouring lines is taken,
        relative to the model, and corrected for the bias of the logarithm.
        """
        known = np.isfinite(self.variance)
        noise = np.zeros(len(known))
        noise[known] = self.variance[known] / np.abs(modelled[known]) ** 2
        if self.degrees_of_freedom is not None:
            noise[known] = _smooth(noise[known], self.degrees_of_freedom[known])
        return noise

    def weight(self, modelled: Complex | Real) -> Real:
        """Return what relative errors of each line are worth, (n,).

        One over the standard deviation of noise and a tolerance of 5 % together, relative to the
        ``modelled`` response (n,). Relative to the measured one, lines that noise has made small
        would count less, and the model come out too large.
        """
        return np.asarray(1 / np.sqrt(self.noise(modelled) + _MODEL_FLOOR**2))


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
        what the Dataset says of itself, by the units of ``response`` (rad/Nm, rad/s/Nm,
        rad/s^2/Nm; the unit of the input does not matter) or its attribute ``quantity``.
    band_hz : lines outside are left out.

    Raises InputError for another Dataset, an axis it does not have, fewer than eight lines, and a
    Dataset of which neither units nor attribute tell the quantity, or both differently.

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
    missing = _DERIVATIVES_MISSING[quantity_of(response, quantity)]
    one = response.sel(output=axis, input=axis)
    frequency = np.asarray(one["frequency_hz"].values, np.float64)
    factor = (2j * np.pi * frequency) ** missing
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
    freedom = _freedom(one, len(frequency))
    return Collocated(
        frequency[kept], value[kept], variance[kept], None if freedom is None else freedom[kept]
    )


def _freedom(one: xr.Dataset, n: int) -> Real | None:
    """Degrees of freedom of the variance of each line, infinite where nothing is said."""
    given = one.get("degrees_of_freedom", one.attrs.get("degrees_of_freedom"))
    if given is None:
        return None
    freedom = np.array(np.broadcast_to(np.asarray(given, np.float64), n))
    freedom[~(freedom > 0)] = np.inf
    return freedom


def _smooth(variance: Real, freedom: Real) -> Real:
    """Means over as many neighbours as make up ten degrees of freedom, of the logarithm."""
    few = freedom < _ENOUGH_FREEDOM
    if not few.any():
        return variance
    half = int(np.ceil((_ENOUGH_FREEDOM / np.median(freedom[few]) - 1) / 2))
    level = np.log(np.maximum(variance, np.finfo(np.float64).tiny))
    # E log of a chi-square over its mean, 2 nu degrees of freedom.
    level[few] -= digamma(freedom[few]) - np.log(freedom[few])
    window = np.ones(2 * half + 1)
    inside = np.convolve(np.pad(np.ones(len(level)), half), window, "valid")
    mean = np.convolve(np.pad(level, half), window, "valid") / inside
    return np.where(few, np.exp(mean), variance)


def standard_errors(slope: Real, residual: Real, noise: Real) -> Real:
    """Standard errors of a weighted least-squares estimate, (p,).

    From the scatter of the lines (`sandwich`), but not below what the known noise makes of them:
    ``noise`` (n,) is the variance of the complex residual of each line, zero if unknown.
    """
    inverse = np.linalg.pinv(slope.T @ slope, hermitian=True)
    # Half of the variance in the real and half in the imaginary part.
    noisy = np.tile(np.sqrt(noise / 2), 2)[:, None] * slope @ inverse
    least = (noisy**2).sum(axis=0)
    return np.asarray(np.sqrt(np.maximum(np.diag(sandwich(slope, residual)), least)))


def sandwich(slope: Real, residual: Real) -> Real:
    """Covariance of a least-squares estimate from the scatter of each line (White 1980).

    ``slope`` (2 n, p) and ``residual`` (2 n,) hold the real parts of all n lines, then the
    imaginary ones; a line's two belong together. Right whatever the weights, which here are a
    compromise between noise and the errors of simple models. Each line's residuals are enlarged
    by what the fit has taken from them (the correction CR2 of Bell and McCaffrey 2002): the few
    lines of a notch decide much and would show too little.
    """
    lines = len(residual) // 2
    rows = slope.reshape(2, lines, -1).swapaxes(0, 1)
    inverse = np.linalg.pinv(slope.T @ slope, hermitian=True)
    share, vectors = np.linalg.eigh(rows @ inverse @ rows.swapaxes(1, 2))
    left = 1 - share
    # A line that alone decides a parameter shows no scatter.
    grow = np.where(left > _DECIDED, 1 / np.sqrt(np.maximum(left, _DECIDED)), 0.0)
    parts = residual.reshape(2, lines).T
    enlarged = np.einsum("nij,nj,nkj,nk->ni", vectors, grow, vectors, parts)
    scores = np.einsum("nip,ni->np", rows, enlarged)
    covariance = inverse @ (scores.T @ scores) @ inverse
    return np.asarray((covariance + covariance.T) / 2)
