"""The waiting time for the steady state, and a test of whether it was reached."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.arguments import Real, between, positive, reals, whole
from axisight.display.summary import summarized
from axisight.errors import InputError

Complex = NDArray[np.complex128]

_BAND = 8  # lines tested together


def mode_time_constant_s(frequency_hz: float, damping_ratio: float) -> float:
    """Return the time constant tau = 1 / (zeta w0) [s] of a mode's decay.

    ``frequency_hz`` is the undamped frequency w0 / (2 pi) [Hz]. ``damping_ratio`` zeta [1] lies in (0, 1].
    Raises InputError for other values.
    """
    positive("frequency_hz", frequency_hz)
    positive("damping_ratio", damping_ratio)
    if damping_ratio > 1:
        raise InputError(f"damping_ratio: expected at most 1, got {damping_ratio}")
    rate = damping_ratio * 2 * math.pi * frequency_hz
    if not math.isfinite(1.0 / rate if rate else math.inf):
        raise InputError(f"frequency_hz, damping_ratio: expected a decay, got {rate:g} 1/s")
    return 1.0 / rate


def waiting_time_s(time_constant_s: float, record_s: float, signal_to_noise: float) -> float:
    """Return the time until a transient is below the noise [s], never negative, thesis (5.6).

    ``T_w = tau / 2 ln(eps^2 tau / (2 T_tot))``. ``time_constant_s`` tau [s] is the dominating time constant.
    ``record_s`` T_tot [s] is the length of the record, typically one period. ``signal_to_noise`` eps [1] is
    the ratio of the amplitudes of signal and noise at a line (5.7). If there is hardly any noise, 1 / eps is
    the relative error to reach. After T_w the mean square of ``exp(-t / tau)`` over the record is 1 / eps^2.

    Raises InputError unless all three are positive and the result is finite.
    """
    tau, total = positive("time_constant_s", time_constant_s), positive("record_s", record_s)
    # Logarithms one by one: the square of a large ratio overflows.
    logarithm = 2 * math.log(positive("signal_to_noise", signal_to_noise))
    logarithm += math.log(tau) - math.log(2) - math.log(total)
    wait = max(0.0, 0.5 * tau * logarithm)
    if not math.isfinite(wait):
        raise InputError(f"time_constant_s: expected a shorter time, got {tau}")
    return wait


@summarized
@dataclass(frozen=True)
class SteadyState:
    """The result of :func:`steady_state`.

    first
        Number of periods to drop.
    reached
        False if all tested periods differ from the periods taken as steady.
    significance
        Probability of dropping a period of a record in steady state.
    p_value
        Probability (n_tested,), for each tested period, that noise alone gives so large a difference from the
        steady periods. It is corrected for the number of bands and channels.
    excess
        Ratio (n_tested,), for each tested period, of the RMS difference from the steady periods to the RMS
        difference from noise alone, in the band with the largest ratio. It is 1 in steady state.
    """

    first: int
    reached: bool
    significance: float
    p_value: Real
    excess: Real


def steady_state(
    signals: Real, last_line: int | None = None, significance: float = 0.01
) -> SteadyState:
    """Return how many leading periods of ``signals`` still contain a transient.

    signals
        Array (n_periods, n_samples, n_channels) with three periods or more. The channels are input and output
        of one experiment, or of several.
    last_line
        Highest line that counts; None counts all lines below Nyquist.
    significance
        Probability of dropping a period of a record in steady state.

    The last half of the periods, at least two, counts as steady; their scatter is the noise. Each earlier
    period is compared with their mean in bands of 8 lines, excited or not. The mean square of the difference
    over the noise follows F(2 B, 2 B (R - 1)) with R steady periods. B is the number of lines in the band,
    or less if few of them carry the noise (Satterthwaite). The p-value of a period is that of its worst band
    and channel, times their number (Bonferroni). Leading periods are dropped until one passes.

    Raises InputError for fewer than three periods, fewer than three samples per period, and a last line that
    is not below Nyquist.
    """
    what = "numbers of shape (n_periods, n_samples, n_channels)"
    signals = reals("signals", signals, what, 3)
    n_periods, n_samples, _ = signals.shape
    if n_periods < 3:
        raise InputError(f"signals: expected three periods or more, got {n_periods}")
    if n_samples < 3:
        raise InputError(f"signals: expected three samples a period or more, got {n_samples}")
    significance = between("significance", significance, 0, 1)
    highest = (n_samples - 1) // 2
    stop = 1 + (highest if last_line is None else whole("last_line", last_line, 1, highest))
    spectra = np.fft.rfft(signals, axis=1)[:, 1:stop]
    n_steady = max(2, (n_periods + 1) // 2)
    steady = spectra[-n_steady:]
    mean = steady.mean(axis=0)
    noise = np.var(steady, axis=0, ddof=1)
    power = np.mean(np.abs(mean) ** 2, axis=0)
    noise = np.maximum(noise, 1e-24 * power + np.finfo(float).tiny)
    p_values, excesses = [], []
    for period in spectra[:-n_steady]:
        square = np.abs(period - mean) ** 2 / (1 + 1 / n_steady)
        p, excess = _worst_band(square, noise, n_steady)
        p_values.append(p)
        excesses.append(excess)
    passed = np.flatnonzero(np.array(p_values) >= significance)
    first = int(passed[0]) if passed.size else len(p_values)
    return SteadyState(
        first, bool(passed.size), significance, np.array(p_values), np.array(excesses)
    )


def _worst_band(square: Real, noise: Real, n_steady: int) -> tuple[float, float]:
    """Return the smallest p-value over bands and channels, corrected, and the largest amplitude ratio."""
    edges = np.arange(0, len(square), _BAND)
    size = np.diff(np.append(edges, len(square)))[:, None]
    level = np.add.reduceat(noise, edges, axis=0)
    ratio = np.add.reduceat(square, edges, axis=0) / level
    # With R - 1 complex degrees of freedom, E s^4 exceeds (E s^2)^2 by the factor 1 + 1 / (R - 1).
    spread = np.add.reduceat(noise**2, edges, axis=0) / (1 + 1 / (n_steady - 1))
    lines = np.clip(level**2 / spread, 1.0, size)
    p = np.asarray(scipy.stats.f.sf(ratio, 2 * lines, 2 * lines * (n_steady - 1)))
    return min(1.0, float(p.min()) * p.size), float(np.sqrt(ratio.max()))
