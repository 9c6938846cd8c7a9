"""Periodic signals that are not multisines: chirp, triangle, square, binary sequences, stepped sine."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from axisight import _core
from axisight.arguments import (
    Lines,
    Real,
    instance,
    lines_below,
    number,
    positive,
    reals,
    seed_of,
    whole,
    words,
)
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.excitation.checks import (
    LARGEST_SIZE,
    SMALLEST_SIZE,
    band_of,
    few_enough,
    per_item,
    size_of,
    whole_samples,
)

# Oversampling of the grid on which the peak of a continuous formula is searched.
_FINE = 32


@summarized
@dataclass(frozen=True, eq=False)
class PeriodicSignal:
    """One period of a sampled signal.

    kind
        Name of the signal, e.g. ``"chirp"``.
    sample_time_s, period
        Sample time [s] and one period, (n_samples,).
    lines
        Lines that are meant to carry power; empty for signals without such lines.
    peak
        Largest absolute value. For chirp and stepped sine it is that of the formula, also between the
        samples; for held signals it is that of the samples.
    settings
        Arguments that the signal was made from.
    """

    kind: str
    sample_time_s: float
    period: Real
    peak: float
    lines: Lines = field(default_factory=lambda: np.empty(0, np.int64))
    settings: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check all fields."""
        object.__setattr__(self, "sample_time_s", positive("sample_time_s", self.sample_time_s))
        period = reals("period", self.period, "numbers of shape (n_samples,)", 1).copy()
        if np.abs(period).max() > LARGEST_SIZE:
            raise InputError(f"period: expected at most {LARGEST_SIZE:g}, got larger ones")
        object.__setattr__(self, "period", period)
        object.__setattr__(self, "peak", size_of("peak", self.peak))
        words("kind", self.kind)
        instance("settings", self.settings, dict)
        object.__setattr__(self, "lines", lines_below("lines", self.lines, len(period)))

    @property
    def n_samples(self) -> int:
        """Samples of the period."""
        return len(self.period)

    @property
    def period_s(self) -> float:
        """Period [s]."""
        return self.n_samples * self.sample_time_s

    @property
    def rms(self) -> float:
        """Effective root mean square: of the power on ``lines``, or of all power without lines."""
        if not self.lines.size:
            return float(np.sqrt(np.mean(self.period**2)))
        spectrum = np.fft.rfft(self.period)[self.lines] / self.n_samples
        return float(np.sqrt(2 * np.sum(np.abs(spectrum) ** 2)))

    @property
    def crest_factor(self) -> float:
        """Peak over effective rms; raises InputError for a signal without power."""
        rms = self.rms
        if not rms > 0:
            raise InputError("period: expected power on the lines for a crest factor, got none")
        return self.peak / rms

    def scaled(self, *, peak: float) -> PeriodicSignal:
        """Return the signal with this peak."""
        factor = size_of("peak", peak) / self.peak
        return replace(self, period=self.period * factor, peak=float(peak))


def chirp(
    period_s: float,
    sample_time_s: float,
    *,
    band_hz: tuple[float, float],
    amplitude: float = 1.0,
    phase_rad: float = 0.0,
) -> PeriodicSignal:
    """Return a chirp ``A sin(2 pi f1 t + pi (f2 - f1) t^2 / T0 + phi)``, Wernholt (2004), (5.4).

    Parameters
    ----------
    period_s : period T0 [s], a whole number of samples.
    sample_time_s : sample time [s].
    band_hz : (f1, f2) [Hz], both multiples of 1/T0; f1 > f2 sweeps down. The lines are those of the band.
    amplitude : A, in the unit of the signal.
    phase_rad : phi [rad].

    The repeated signal has no jump where f2 - f1 is an even multiple of 1/T0, or ``phase_rad`` a
    multiple of pi. Elsewhere it jumps by up to 2 A at the end of the period. A small mean remains,
    which depends on ``phase_rad``. Raises InputError naming the field.

    """
    n = whole_samples("period_s", period_s, sample_time_s)
    band_hz = band_of("band_hz", band_hz)
    ends = [f * period_s for f in band_hz]
    first, last = (round(k) for k in ends)
    if max(abs(ends[0] - first), abs(ends[1] - last)) > 1e-9 * max(ends) or first == last:
        raise InputError(
            f"band_hz: expected two different multiples of {1 / period_s:g} Hz, got {band_hz}"
        )
    low, high = min(first, last), max(first, last)
    if not 1 <= low < high < n / 2:
        raise InputError(
            f"band_hz: expected at least {1 / period_s:g} Hz and below {0.5 / sample_time_s:g} Hz "
            f"(Nyquist), got {band_hz}"
        )
    lines = np.arange(low, high + 1, dtype=np.int64)
    amplitude = size_of("amplitude", amplitude)
    phase_rad = number("phase_rad", phase_rad)

    def at(part: Real) -> Real:
        return amplitude * np.sin(
            2 * np.pi * first * part + np.pi * (last - first) * part**2 + phase_rad
        )

    fine = at(np.arange(_FINE * n) / (_FINE * n))
    return PeriodicSignal(
        "chirp",
        sample_time_s,
        at(np.arange(n) / n),
        peak=float(np.abs(fine).max()),
        lines=lines,
        settings={
            "period_s": period_s,
            "band_hz": list(band_hz),
            "amplitude": amplitude,
            "phase_rad": phase_rad,
        },
    )


def triangle(period_s: float, sample_time_s: float, *, amplitude: float = 1.0) -> PeriodicSignal:
    """Return a symmetric triangle wave of height ``amplitude`` that starts at zero, rising.

    ``period_s`` [s] must be a multiple of four samples of ``sample_time_s`` [s], so that samples hit
    the tips. Raises InputError naming the field.
    """
    n = whole_samples("period_s", period_s, sample_time_s)
    if n % 4:
        raise InputError(f"period_s: expected a multiple of four samples, got {n}")
    amplitude = size_of("amplitude", amplitude)
    quarter = n // 4
    ramp = np.arange(quarter) / quarter
    period = amplitude * np.concatenate([ramp, 1 - ramp, -ramp, ramp - 1])
    settings = {"period_s": period_s, "amplitude": amplitude}
    return PeriodicSignal("triangle", sample_time_s, period, float(amplitude), settings=settings)


def square(
    period_s: float, sample_time_s: float, *, amplitude: float = 1.0, smoothing_samples: int = 40
) -> PeriodicSignal:
    """Return a square wave smoothed by a triangular window, Wernholt (2004), (7.3).

    The wave is plus ``amplitude`` in the first half of ``period_s`` [s] and minus ``amplitude`` in
    the second. The period is an even number of samples of ``sample_time_s`` [s];
    ``smoothing_samples`` is l, the half length of the window. As a velocity reference, the wave
    keeps motors away from standstill. Raises InputError naming the field.
    """
    ratio = positive("period_s", period_s) / positive("sample_time_s", sample_time_s)
    few_enough("period_s", math.ceil(min(ratio, 1e18)))
    period = _core.square_period(
        size_of("amplitude", amplitude),
        positive("period_s", period_s),
        whole("smoothing_samples", smoothing_samples, 0),
        positive("sample_time_s", sample_time_s),
    )
    settings = {
        "period_s": period_s,
        "amplitude": amplitude,
        "smoothing_samples": smoothing_samples,
    }
    peak = float(np.abs(period).max())
    return PeriodicSignal("square", sample_time_s, period, peak, settings=settings)


def prbs(
    sample_time_s: float, *, bits: int, amplitude: float = 1.0, hold: int = 1
) -> PeriodicSignal:
    """Return a maximum-length binary sequence of ``2^bits - 1`` values plus or minus A.

    A is ``amplitude``, and ``bits`` is 2 to 24. Each value is held for ``hold`` samples of
    ``sample_time_s`` [s], so the period has ``(2^bits - 1) hold`` samples. The mean has the size
    ``A / (2^bits - 1)``. The autocorrelation is ``-A^2 / (2^bits - 1)`` at every shift by whole
    values other than zero. Raises InputError naming the field.
    """
    bits, hold = whole("bits", bits, 2, 24), whole("hold", hold)
    amplitude = size_of("amplitude", amplitude)
    few_enough("bits, hold", (2**bits - 1) * hold)
    sequence, _ = scipy.signal.max_len_seq(bits)
    period = amplitude * np.repeat(2.0 * sequence - 1.0, hold)
    settings = {"bits": bits, "amplitude": amplitude, "hold": hold}
    return PeriodicSignal("prbs", sample_time_s, period, float(amplitude), settings=settings)


def discrete_interval_binary(
    period_s: float,
    sample_time_s: float,
    *,
    lines: ArrayLike,
    weight: ArrayLike = 1.0,
    amplitude: float = 1.0,
    hold: int = 1,
    starts: int = 50,
    seed: int = 0,
) -> PeriodicSignal:
    """Return a binary signal with most of its power on chosen lines.

    Parameters
    ----------
    period_s : period [s], a whole number of holds.
    sample_time_s : sample time [s].
    lines : lines k that carry the power, multiples of 1/``period_s``.
    weight : amplitude wanted on each line, one number or (n_lines,).
    amplitude : size of the two values.
    hold : samples between possible changes of sign.
    starts, seed : number of random starts; start i is a function of (``seed``, i).

    The method alternates between the signs of a multisine with amplitudes ``weight`` and the phases
    of these signs, until the signs repeat (Van den Bos and Krol 1979). It keeps the start with the
    largest weighted sum of amplitudes on the lines. ``settings["power_share"]`` is the share of the
    power on the lines. Raises InputError naming the field.

    """
    n = whole_samples("period_s", period_s, sample_time_s)
    hold = whole("hold", hold)
    if n % hold:
        raise InputError(f"hold: expected a divisor of the {n} samples of a period, got {hold}")
    count = n // hold
    chosen = lines_below("lines", lines, count)
    if not chosen.size:
        raise InputError("lines: expected at least one line, got none")
    w = per_item("weight", weight, len(chosen))
    for one in w:
        size_of("weight", one)
    amplitude = size_of("amplitude", amplitude)
    best = max(
        (
            _settled(w, chosen, count, _core.random_phases(len(w), seed_of("seed", seed), run))
            for run in range(whole("starts", starts))
        ),
        key=lambda signs: float(w @ np.abs(np.fft.rfft(signs)[chosen])),
    )
    period = amplitude * np.repeat(best, hold)
    signal = PeriodicSignal(
        "discrete_interval_binary", sample_time_s, period, float(amplitude), lines=chosen
    )
    settings = {
        "period_s": period_s,
        "amplitude": amplitude,
        "hold": hold,
        "starts": starts,
        "seed": seed,
        "power_share": (signal.rms / amplitude) ** 2,
    }
    return replace(signal, settings=settings)


def _settled(weight: Real, lines: Lines, count: int, phase: Real) -> Real:
    """Return signs that equal those of the multisine with the phases of these signs."""
    spectrum = np.zeros(count // 2 + 1, np.complex128)
    turn = np.exp(1j * phase)
    signs = np.zeros(count)
    # The weighted sum of amplitudes never falls, so the signs settle long before 1000 rounds.
    for _ in range(1000):
        spectrum[lines] = weight * turn
        now = np.where(np.fft.irfft(spectrum, count) >= 0, 1.0, -1.0)
        if np.array_equal(now, signs):
            break
        signs = now
        found = np.fft.rfft(signs)[lines]
        size = np.abs(found)
        turn = np.where(size > 0, found / np.where(size > 0, size, 1.0), turn)
    return signs


@summarized
@dataclass(frozen=True)
class SteppedSine:
    """A sequence of single sines, each over a whole number of periods T0.

    signal
        The whole sequence as one long period.
    lines
        Line k of each step, a multiple of 1/T0.
    first_sample, n_samples
        First sample of the part to use of each step, after its waiting periods, and the number of
        samples of that part.
    """

    signal: PeriodicSignal
    lines: Lines
    first_sample: Lines
    n_samples: int


def stepped_sine(
    period_s: float,
    sample_time_s: float,
    *,
    frequency_hz: ArrayLike,
    amplitude: ArrayLike = 1.0,
    waiting_periods: int = 1,
    periods: int = 1,
) -> SteppedSine:
    """Return single sines at ``frequency_hz``, multiples of 1/``period_s``, one after the other.

    ``frequency_hz`` are in Hz, ``period_s`` and the sample time ``sample_time_s`` in s. Each sine lasts
    ``waiting_periods`` periods for the transient and ``periods`` periods to use. ``amplitude`` is one
    number or one per frequency. Every step starts at phase zero, so there is no jump. Raises
    InputError naming the field.
    """
    n = whole_samples("period_s", period_s, sample_time_s)
    frequency = reals("frequency_hz", frequency_hz, "one frequency or a list", (0, 1))
    exact = np.atleast_1d(frequency) * period_s
    lines = np.round(exact)
    if np.any(np.abs(exact - lines) > 1e-9 * np.abs(lines)):
        raise InputError(f"frequency_hz: expected multiples of {1 / period_s:g} Hz")
    if np.any((lines < 1) | (2 * lines >= n)):
        raise InputError(
            f"frequency_hz: expected above 0 and below {0.5 / sample_time_s:g} Hz (Nyquist)"
        )
    chosen = lines.astype(np.int64)
    sizes = per_item("amplitude", amplitude, len(chosen))
    if not np.all(usable := (sizes >= SMALLEST_SIZE) & (sizes <= LARGEST_SIZE)):
        at = int(np.argmin(usable))
        raise InputError(
            f"amplitude: expected positive numbers, got {sizes[at]:g} at "
            f"{chosen[at] / period_s:g} Hz; leave the step out instead"
        )
    wait, use = whole("waiting_periods", waiting_periods, 0), whole("periods", periods)
    step = few_enough("waiting_periods, periods", (wait + use) * n * len(chosen)) // len(chosen)
    time = np.arange(step) % n / n
    samples = (sizes[:, None] * np.sin(2 * np.pi * chosen[:, None] * time)).ravel()
    signal = PeriodicSignal(
        "stepped_sine",
        sample_time_s,
        samples,
        float(np.abs(sizes).max()),
        settings={
            "period_s": period_s,
            "frequency_hz": (chosen / period_s).tolist(),
            "amplitude": sizes.tolist(),
            "waiting_periods": wait,
            "periods": use,
        },
    )
    first = np.arange(len(chosen)) * step + wait * n
    return SteppedSine(signal, chosen, first.astype(np.int64), use * n)
