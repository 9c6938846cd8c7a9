"""Find the period of a signal from its autocorrelation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from axisight.arguments import Real, reals
from axisight.display.summary import summarized
from axisight.errors import InputError, NotPeriodicError
from axisight.records.lines import repeating_lines

_LEAST_REPETITION = 0.5  # as much noise as signal
_INTEGER_TOLERANCE = 0.05  # samples over the whole record


@summarized
@dataclass(frozen=True)
class Period:
    """A period and its uncertainty.

    samples
        Period [samples], not rounded.
    standard_error
        Standard error of ``samples`` [samples].
    repetition
        Normalised autocorrelation at the period, 1 for a signal that repeats exactly; noise of
        q times the signal's power gives 1 / (1 + q).
    n_periods
        Number of whole periods in the record.
    """

    samples: float
    standard_error: float
    repetition: float
    n_periods: int

    @property
    def n_samples(self) -> int:
        """The period as a whole number of samples."""
        return round(self.samples)


def autocorrelation(x: Real) -> Real:
    """Return the autocorrelation of ``x`` (n,) at lags 0 to n - 1, normalised by the overlap.

    ``2 sum x(n) x(n + L) / sum (x(n)^2 + x(n + L)^2)`` over the overlap (McLeod and Wyvill,
    2005). It lies within [-1, 1] and is 1 only if the signal repeats exactly.
    """
    products = scipy.signal.fftconvolve(x, x[::-1])[len(x) - 1 :]
    energy = np.concatenate(([0.0], np.cumsum(x * x)))
    lags = np.arange(len(x))
    both = energy[len(x) - lags] + (energy[-1] - energy[lags])
    floor = 1e-12 * max(energy[-1], np.finfo(float).tiny)
    return np.asarray(2 * products / np.maximum(both, floor))


def find_period(signal: Real) -> Period:
    """Return the period of a signal (n,) or (n, channels) that contains at least two of them.

    The mean autocorrelation of the channels gives a lag at which the signal repeats; a straight line through
    all multiples of the lag refines it. The period is that lag divided by the greatest common divisor of the
    lines above the noise. So the result is never a multiple of the period, nor half of it if odd lines are
    weak.

    The signal must not drift: use a reference or a torque, not a position.

    Raises NotPeriodicError if the signal does not repeat (autocorrelation below 0.5), and InputError if it
    is constant or repeats after a number of samples that is not whole.
    """
    signal = reals("signal", signal, "numbers of shape (n,) or (n, channels)", (1, 2))
    x = np.atleast_2d(signal.T)
    x = x - x.mean(axis=1, keepdims=True)
    scale = np.sqrt(np.mean(x * x, axis=1))
    active = scale > 1e-6 * max(scale.max(), np.finfo(float).tiny)
    if x.shape[1] < 8 or not scale.max() > 1e-12 * np.abs(signal).max():
        raise InputError("signal: expected one that moves, to find its period, got a constant")
    rho = np.mean([autocorrelation(row) for row in x[active]], axis=0)
    candidates = [_straight_line(rho, lag) for lag in _good_lags(rho)]
    rough = next((c for c in candidates if _is_whole(c)), candidates[0])
    if _is_whole(rough):
        rough = _straight_line(rho, _whole_period(x[active], rough.n_samples))
    if not _is_whole(rough):
        raise InputError(not_whole(rough.samples))
    return rough


def _good_lags(rho: Real) -> list[int]:
    """Return the lags, ascending, with nearly the best autocorrelation; raise NotPeriodicError below 0.5."""
    longest = len(rho) // 2
    reach = rho[: longest + 2]
    negative = np.flatnonzero(reach < 0)
    peaks = 1 + np.flatnonzero((reach[1:-1] > reach[:-2]) & (reach[1:-1] >= reach[2:]))
    peaks = peaks[peaks > negative[0]] if negative.size else peaks[:0]
    # Interpolated heights, because a period of n + 1/2 samples would otherwise look worse than its multiples.
    left, mid, right = reach[peaks - 1], reach[peaks], reach[peaks + 1]
    bend = np.minimum(left - 2 * mid + right, -1e-15)
    heights = mid - np.clip((left - right) ** 2 / (8 * bend), -0.5, 0)
    best = float(heights.max()) if peaks.size else 0.0
    if best < _LEAST_REPETITION:
        raise NotPeriodicError(
            "signal: expected at least two periods, got none that repeats: the best "
            f"autocorrelation is {best:.2f}, below {_LEAST_REPETITION}; record more periods or "
            "give period_s"
        )
    good = peaks[best - heights <= 3 * abs(1 - best) + 1e-4]
    return [int(lag) for lag in good]


def _straight_line(rho: Real, lag: int) -> Period:
    """Return a lag refined by a straight line through the peaks near its multiples."""
    n = len(rho)
    orders: list[int] = []
    places: list[float] = []
    errors: list[float] = []
    slope = float(lag)
    # Further than a sample from the lag, the peaks are not those of its multiples.
    while not orders or ((len(orders) + 1) * slope < 0.75 * n and abs(slope - lag) < 1):
        m = len(orders) + 1
        middle = round(m * slope)
        reach = np.arange(max(1, middle - 2), min(n - 1, middle + 3))
        top = int(reach[np.argmax(rho[reach])])
        left, mid, right = rho[top - 1 : top + 2]
        bend = min(left - 2 * mid + right, -1e-15)
        orders.append(m)
        places.append(top + float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)))
        # Error of the parabola, plus that of a delay between two noisy copies.
        errors.append(0.01 + float(np.sqrt(2 * max(1 - mid, 0.0) / (-bend * (n - top)))))
        slope = float(np.dot(orders, places) / np.dot(orders, orders))
    order, place = np.array(orders, float), np.array(places)
    squares = float(order @ order)
    variance = float(order**2 @ np.square(errors)) / squares**2
    if len(orders) > 1:
        residual = place - slope * order
        variance = max(variance, float(residual @ residual) / (len(order) - 1) / squares)
    return Period(slope, math.sqrt(variance), float(rho[round(slope)]), int((n + 0.5) // slope))


def _is_whole(found: Period) -> bool:
    off = abs(found.samples - found.n_samples)
    return off <= 4 * found.standard_error or off * found.n_periods <= _INTEGER_TOLERANCE


def not_whole(samples: float) -> str:
    """Return the message for a period that is not a whole number of samples."""
    return (
        f"period: expected a whole number of samples, got {samples:.6g}; excite at multiples of "
        f"1 / (N T) with a whole N (here {round(samples)}), or resample the record to a sample "
        "time that divides the period"
    )


def _whole_period(x: Real, lag: int) -> int:
    """Return the period: a lag at which ``x`` repeats, divided by the common divisor of its lines."""
    n = int(x.shape[1])
    # The longest block that fits twice resolves the lines best.
    block = max(1, n // 2 // lag) * lag
    count = n // block
    lines: list[int] = []
    for row in x:
        mask = repeating_lines(row[n - count * block :].reshape(count, block))
        lines += np.flatnonzero(mask).tolist()
    common = math.gcd(block, *lines) if lines else block // lag
    return block // common
