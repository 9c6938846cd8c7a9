"""Estimate and remove linear drift over the periods, as in positions."""

from __future__ import annotations

import numpy as np

from axisight.arguments import Real, real_array, shown
from axisight.errors import InputError


def drift_per_period(signal: Real) -> Real:
    """Return the drift per period (..., channels) of ``signal`` (..., n_periods, n_samples, channels).

    The result, in the unit of the signal, is the median slope of the period means over all pairs of periods
    (Theil 1950, Sen 1968). A transient in the first periods does not bias it. A straight line through the
    samples of a period would count part of the excitation as drift; the mean over a whole period does not.

    Raises InputError for fewer than two periods, and for values that are not finite.
    """
    signal = _periods(signal)
    n_periods = signal.shape[-3]
    means = signal.mean(axis=-2)
    first, last = np.triu_indices(n_periods, 1)
    slopes = (means[..., last, :] - means[..., first, :]) / (last - first)[:, None]
    return np.asarray(np.median(slopes, axis=-2))


def remove_drift(signal: Real) -> Real:
    """Return ``signal`` (..., n_periods, n_samples, channels) without its linear drift.

    The ramp is zero in the middle of the record, so that the operating point stays. Velocity
    and acceleration responses then follow from the position DFT, times i w and (i w)^2.
    Raises InputError for fewer than two periods, and for values that are not finite.
    """
    signal = _periods(signal)
    slope = drift_per_period(signal)
    n_periods, n_samples = signal.shape[-3:-1]
    total = n_periods * n_samples
    ramp = (np.arange(total) - (total - 1) / 2).reshape(n_periods, n_samples) / n_samples
    return np.asarray(signal - ramp[..., None] * slope[..., None, None, :])


def _periods(signal: object) -> Real:
    array = real_array(signal)
    if (
        array is None
        or array.ndim < 3
        or 0 in array.shape
        or array.shape[-3] < 2
        or not np.isfinite(array).all()
    ):
        raise InputError(
            "signal: expected finite numbers of shape (..., n_periods, n_samples, channels) with "
            f"at least two periods to see drift, got {shown(signal)}"
        )
    return np.asarray(array, dtype=np.float64)
