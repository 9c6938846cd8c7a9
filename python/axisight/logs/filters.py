"""Zero-phase filtering, differentiation and decimation of uniformly sampled signals."""

from __future__ import annotations

import math

import numpy as np

from axisight.errors import InputError
from axisight.logs.log import Floats
from axisight.statistics.recursion import zero_phase

LOWPASS_ORDER = 4
"""Default order of the low-pass; running it forward and backward doubles the order of the gain."""
_DECIMATION_SHARE = 0.8
"""Cutoff of the decimation filter as a share of the new Nyquist frequency."""
_PADDING_PERIODS = 10.0
"""Padding in cutoff periods: the start-up transient of order 4 falls to 1e-10 over them."""


def lowpass(
    x: Floats,
    sample_time_s: float,
    cutoff_hz: float,
    order: int = LOWPASS_ORDER,
    *,
    curved: bool = False,
) -> Floats:
    """Return `x` (n,) or (n, k), low-passed along its first dimension by a zero-phase Butterworth filter.

    `sample_time_s` (s) is the step of `x`. The filter of `order` runs forward and backward: the gain is
    1 / (1 + (f / cutoff_hz)^(2 order)) up to the bilinear frequency warping, so -6 dB at `cutoff_hz` (Hz).
    The ends are padded by odd reflection over ten periods of the cutoff, or over the whole signal if it is
    shorter. ``curved`` adds the curvature at each end to the padding: set it if the signal begins or ends in
    motion and its acceleration matters.

    Raises InputError when the cutoff is not between 0 and Nyquist, and when there are at most 3 (order + 1)
    samples. Raises InputError for values that are not finite or not of shape (n,) or (n, k), a sample time
    that is not positive, and an order below 1.
    """
    x = _checked(x, sample_time_s, order)
    nyquist = 0.5 / sample_time_s
    if not 0.0 < cutoff_hz < nyquist:
        raise InputError(
            f"cutoff_hz: expected between 0 and the Nyquist frequency {nyquist:g} Hz, got "
            f"{cutoff_hz:g} Hz"
        )
    least = 3 * (order + 1)
    if x.shape[0] <= least:
        raise InputError(
            f"x: expected more than {least} samples for order {order}, got {x.shape[0]}"
        )
    pad = min(x.shape[0] - 1, max(least, math.ceil(_PADDING_PERIODS / (cutoff_hz * sample_time_s))))
    extended = _reflected(x, pad)
    if curved:
        window = max(least, math.ceil(1.0 / (cutoff_hz * sample_time_s)))
        _add_curvature(extended, x, pad, window)
    smooth = zero_phase(order, cutoff_hz / nyquist, extended)
    return np.ascontiguousarray(smooth[pad:-pad])


def _reflected(x: Floats, pad: int) -> Floats:
    """Return a signal padded by its odd reflection at both ends."""
    first, last = 2.0 * x[0] - x[pad:0:-1], 2.0 * x[-1] - x[-2 : -pad - 2 : -1]
    return np.concatenate([first, x, last])


def _add_curvature(extended: Floats, x: Floats, pad: int, window: int) -> None:
    """Add the curvature at each end of ``x`` to its padding, which then continues a parabola exactly.

    The curvature at an end comes from a cubic fit to ``window`` samples.
    """
    window = min(window, x.shape[0])
    # Second derivative of the cubic at its first sample, per sample squared.
    powers = np.vander(np.arange(window, dtype=np.float64), 4, increasing=True)
    weights = 2.0 * np.linalg.pinv(powers)[2]
    k = np.arange(1.0, pad + 1.0).reshape(-1, *[1] * (x.ndim - 1))
    extended[:pad] += (np.tensordot(weights, x[:window], 1) * k**2)[::-1]
    extended[-pad:] += np.tensordot(weights, x[::-1][:window], 1) * k**2


def differentiate(
    position: Floats,
    sample_time_s: float,
    cutoff_hz: float,
    order: int = LOWPASS_ORDER,
    *,
    curved: bool = False,
) -> tuple[Floats, Floats]:
    """Return velocity and acceleration of `position` (n,) or (n, k), in its unit per s and s^2.

    `lowpass` with `cutoff_hz` (Hz), `order` and ``curved`` filters the position, sampled every
    `sample_time_s` (s). Central differences over one sample on either side follow, one-sided at the ends.
    Both results are second-order accurate in the sample time. Raises InputError like `lowpass`.
    """
    smooth = lowpass(position, sample_time_s, cutoff_hz, order, curved=curved)
    velocity = np.gradient(smooth, sample_time_s, axis=0, edge_order=2)
    acceleration = np.empty_like(smooth)
    acceleration[1:-1] = smooth[2:] - 2.0 * smooth[1:-1] + smooth[:-2]
    acceleration[0] = 2.0 * smooth[0] - 5.0 * smooth[1] + 4.0 * smooth[2] - smooth[3]
    acceleration[-1] = 2.0 * smooth[-1] - 5.0 * smooth[-2] + 4.0 * smooth[-3] - smooth[-4]
    return np.asarray(velocity, dtype=np.float64), acceleration / sample_time_s**2


def decimate_zero_phase(x: Floats, factor: int, order: int = LOWPASS_ORDER) -> Floats:
    """Return every `factor`-th sample of `x` (n,) or (n, k) after a zero-phase low-pass of `order`.

    The cutoff is 0.8 of the new Nyquist frequency. Filtering both sides of a regression in the same
    way (parallel decimation) leaves its solution unbiased. A factor of 1 returns a copy. Raises
    InputError when `factor` is not a positive integer, and like `lowpass`.
    """
    if isinstance(factor, bool) or not isinstance(factor, int | np.integer) or factor < 1:
        raise InputError(f"factor: expected a positive integer, got {factor!r}")
    if factor == 1:
        return _checked(x, 1.0, order).copy()
    return np.ascontiguousarray(lowpass(x, 1.0, _DECIMATION_SHARE * 0.5 / factor, order)[::factor])


def _checked(x: Floats, sample_time_s: float, order: int) -> Floats:
    x = np.asarray(x, dtype=np.float64)
    if x.ndim not in {1, 2} or x.size == 0:
        raise InputError(f"x: expected shape (n,) or (n, k), got {x.shape}")
    if not np.isfinite(x).all():
        raise InputError(f"x: expected finite values, got {int((~np.isfinite(x)).sum())} NaN/inf")
    if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
        raise InputError(f"sample_time_s: expected a positive time, got {sample_time_s!r}")
    if order < 1:
        raise InputError(f"order: expected at least 1, got {order}")
    return x
