"""The residual over speed, angle, load or time, and by orders of the motor angle."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.gap.hypotheses.ripple_orders import HIGHEST_ORDER, Turning
from axisight.logs import Log, lowpass
from axisight.robot import Robot

Array = NDArray[np.float64]

Against = Literal["speed", "angle", "load", "time"]
AGAINST: dict[Against, str] = {
    "speed": "motor speed",
    "angle": "motor angle",
    "load": "measured torque",
    "time": "time",
}

# Corner of the low-pass for speeds and loads, the same as for regimes.
_SMOOTH_HZ = 20.0
_BINS = 40
# Fewest samples of a bin that is shown.
_LEAST = 5


def quantity(log: Log, axis: int, against: Against) -> Array:
    """Return a quantity of one axis (from 0) along a log, (n,): [rad/s], [rad], [Nm] or [s]."""
    cutoff = min(_SMOOTH_HZ, 0.4 / log.sample_time_s)
    if against == "time":
        return log.time_s
    if against == "load":
        return lowpass(log.torque_nm[:, [axis]], log.sample_time_s, cutoff)[:, 0]
    smooth = lowpass(log.position_rad[:, [axis]], log.sample_time_s, cutoff)[:, 0]
    return smooth if against == "angle" else np.gradient(smooth, log.sample_time_s)


def in_bins(x: Array, residual: Array) -> tuple[Array, Array, Array]:
    """Return centres of equal bins of ``x`` (n,), mean and rms of a residual (n,) in each bin; all (n_bins,).

    Bins with fewer than five samples are left out.
    """
    known = np.isfinite(residual)
    x, residual = x[known], residual[known]
    if len(x) == 0 or np.ptp(x) == 0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    at = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    count = np.bincount(at, minlength=_BINS)
    enough = count >= _LEAST
    mean = np.bincount(at, residual, _BINS)[enough] / count[enough]
    rms = np.sqrt(np.bincount(at, residual**2, _BINS)[enough] / count[enough])
    return (edges[:-1] + edges[1:])[enough] / 2, mean, rms


# The highest order at usual speeds lies below this frequency.
_ORDER_RATE_HZ = 1000.0


def order_spectrum(log: Log, axis: int, residual: Array) -> tuple[Array, Array]:
    """Return orders of the motor angle (n_orders,) and the amplitude of each in a residual (n,) [Nm].

    A least-squares fit of cosine and sine for one order at a time. NaN if the motor turned too little, or too
    fast for the sample rate.
    """
    orders = np.arange(1, HIGHEST_ORDER + 1)
    if not np.isfinite(residual).all():
        return orders.astype(float), np.full(len(orders), np.nan)
    step = max(1, round(1 / log.sample_time_s / _ORDER_RATE_HZ))
    if step > 1:
        residual = lowpass(residual[:, None], log.sample_time_s, 0.4 / (step * log.sample_time_s))[
            :, 0
        ]
    angle = quantity(log, axis, "angle")
    speed = np.gradient(angle, log.sample_time_s)
    kept = residual[::step]
    spectra = Turning(kept, angle[::step], speed[::step], log.sample_time_s * step).spectra
    weights = np.full(spectra.shape[1], 2.0 / len(kept))
    weights[0] = 0.0
    along = (spectra * weights) @ np.conj(np.fft.rfft(kept))
    c, s = spectra[: len(orders)], spectra[len(orders) :]
    cc, ss = ((abs(x) ** 2) @ weights for x in (c, s))
    cs = (c * np.conj(s)).real @ weights
    rc, rs = along.real[: len(orders)], along.real[len(orders) :]
    apart = cc * ss - cs**2
    # Over a small turn, cosine and sine of an order are nearly collinear.
    seen = apart > 1e-4 * np.maximum(cc * ss, (0.05 * len(kept)) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b = (ss * rc - cs * rs) / apart, (cc * rs - cs * rc) / apart
    return orders.astype(float), np.where(seen, np.hypot(a, b), np.nan)


def responses(
    robot: Robot, effects: tuple[Effect, ...], frequency_hz: Array
) -> NDArray[np.complex128]:
    """Return the response from motor torques to motor angles, (n_freq, n_axes, n_axes) [rad/Nm].

    Linear, at the operating point, as a sampled loop sees it. Raises InputError for effects without a linear
    response.
    """
    found = robot.zoh_response(frequency_hz, effects=effects)
    return np.asarray(found.values)
