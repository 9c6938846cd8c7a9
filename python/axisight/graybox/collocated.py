"""The collocated response of one axis: motor torque to the acceleration of the same motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.confidence import median_freedom
from axisight.frf.pooled import neighbours_for, pooled_variance
from axisight.frf.quantity import ORDER, quantity_of
from axisight.frf.response import Flag
from axisight.graybox.normal_matrix import pseudo_inverse, pseudo_root
from axisight.statistics.cluster_scatter import ClusterScatter

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_FEWEST_LINES = 8
# Relative error that simple models of a response are allowed.
_MODEL_FLOOR = 0.05


@summarized
@dataclass(frozen=True, eq=False)
class Collocated:
    """Usable lines of the collocated response of one axis.

    frequency_hz
        Ascending, (n,) [Hz].
    acceleration
        Torque to motor acceleration, complex (n,) [rad/s^2/Nm].
    variance
        E|dG|^2 of ``acceleration``, (n,); NaN where unknown.
    degrees_of_freedom
        Complex degrees of freedom of the variance; None if the variance is known exactly.
    """

    frequency_hz: Real
    acceleration: Complex
    variance: Real
    degrees_of_freedom: float | None = None

    @property
    def angular_rad_s(self) -> Real:
        """Angular frequencies [rad/s]."""
        return np.asarray(2 * np.pi * self.frequency_hz)

    def between(self, low_rad_s: float, high_rad_s: float) -> Collocated:
        """Return the lines from ``low_rad_s`` to ``high_rad_s``."""
        kept = (self.angular_rad_s >= low_rad_s) & (self.angular_rad_s <= high_rad_s)
        return self.lines(kept)

    def lines(self, kept: NDArray[np.bool_]) -> Collocated:
        """Return the lines where ``kept`` (n,) is true."""
        return Collocated(
            self.frequency_hz[kept],
            self.acceleration[kept],
            self.variance[kept],
            self.degrees_of_freedom,
        )

    def noise(self, modelled: Complex | Real) -> Real:
        """Return the variance relative to the squared ``modelled`` response (n,), zero if unknown.

        A variance from few periods scatters so much that chance would select the lines. Therefore
        the variances of neighbouring lines are pooled (`pooled_variance`).
        """
        variance, freedom = self.variance, self.degrees_of_freedom
        count = neighbours_for(freedom, len(variance))
        if freedom is not None and count:
            variance = pooled_variance(np.abs(modelled), variance, freedom, count)
        known = np.where(np.isfinite(variance), variance, 0.0)
        return np.asarray(known / np.abs(modelled) ** 2)

    def weight(self, modelled: Complex | Real) -> Real:
        """Return the weights of relative errors at each line, (n,).

        They are one over the standard deviation of noise and a tolerance of 5 % together, relative to
        the ``modelled`` response (n,). Relative to the measured one, lines that noise made small
        would count less, and the model would become too large.
        """
        return np.asarray(1 / np.sqrt(self.noise(modelled) + _MODEL_FLOOR**2))


def collocated(
    response: xr.Dataset,
    *,
    axis: int = 1,
    quantity: str | None = None,
    band_hz: tuple[float, float] | None = None,
) -> Collocated:
    """Return element (axis, axis) of a frequency response, from torque to acceleration.

    Parameters
    ----------
    response : Dataset of an estimator of `axisight.frf`, from torque to motor motion. Lines that are
        flagged or zero are left out.
    axis : the axis, from 1.
    quantity : output of the response, ``"position"``, ``"velocity"`` or ``"acceleration"``. None:
        taken from the units of ``response`` (rad/Nm, rad/s/Nm, rad/s^2/Nm; the unit of the input does
        not matter) or from the attribute ``quantity``.
    band_hz : lowest and highest line to keep [Hz].

    Raises InputError for another Dataset, an axis that it does not have, fewer than eight lines, and a
    quantity on which units and attribute are silent or contradict each other.

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
    missing = ORDER["acceleration"] - ORDER[quantity_of(response, quantity)]
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
    return Collocated(frequency[kept], value[kept], variance[kept], median_freedom(one))


def standard_errors(slope: Real, residual: Real, noise: Real) -> Real:
    """Return the standard errors of a weighted least-squares estimate, (p,).

    They come from the scatter of the lines (`sandwich`), but are not below those from the known noise.
    ``noise`` (n,) is the variance of the complex residual of each line, zero if unknown. Standard
    errors are infinite for parameters that the lines do not show, and NaN for those that one line
    decides.
    """
    inverse, _, _ = pseudo_inverse(slope.T @ slope)
    # Real and imaginary part each carry half of the variance.
    noisy = np.tile(np.sqrt(noise / 2), 2)[:, None] * slope @ inverse
    least = (noisy**2).sum(axis=0)
    return np.asarray(np.sqrt(np.maximum(np.diag(sandwich(slope, residual)), least)))


def sandwich(slope: Real, residual: Real) -> Real:
    """Return the covariance of a least-squares estimate from the scatter of each line (White 1980).

    ``slope`` (2 n, p) and ``residual`` (2 n,) hold the real parts of all n lines, then the imaginary
    parts; both parts of a line form one cluster. The covariance is right for any weights, which here
    are a compromise between noise and the errors of simple models. `ClusterScatter` corrects each
    line's residuals for the part that the fit has absorbed. Without it the few lines of a notch,
    which decide much, would show too little scatter.

    Parameters that the lines do not show have an infinite variance. If one line alone decides a
    direction, its residuals there are zero and show no scatter. Parameters with more than half of
    their variance from such directions are NaN, because their variance is unknown.
    """
    lines = len(residual) // 2
    rows = slope.reshape(2, lines, -1).swapaxes(0, 1)
    root, _, blind = pseudo_root(slope.T @ slope)
    scatter = ClusterScatter(root, rows @ root, residual.reshape(2, lines).T)
    covariance = scatter.covariance.copy()
    covariance[blind], covariance[:, blind] = np.nan, np.nan
    covariance[blind, blind] = np.inf
    return covariance
