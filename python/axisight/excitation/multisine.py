"""Multisines: sums of sines on chosen lines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import (
    Lines,
    Real,
    complexes,
    lines_below,
    positive,
    reals,
    seed_of,
    whole,
)
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.excitation.checks import (
    LARGEST_SIZE,
    MOST_SAMPLES,
    SMALLEST_SIZE,
    numbers,
    per_item,
    size_of,
    whole_samples,
)
from axisight.excitation.lines import Grid, line_set


def _none() -> Lines:
    return np.empty(0, np.int64)


def _nothing() -> Real:
    return np.empty(0)


@summarized
@dataclass(frozen=True, eq=False)
class Multisine:
    """One period of ``x(t) = sum_k A_k sin(2 pi k t / T0 + phi_k)``, Wernholt (2004), (5.5).

    sample_time_s, n_samples
        Sample time T [s] and samples N of the period T0 = N T.
    lines, amplitude, phase_rad
        Excited lines k, ascending, 1 <= k < N / 2; amplitudes A > 0 in the unit of the
        signal; phases [rad]; all (n_lines,).
    detection_lines
        Lines that are left free to detect distortion.
    snow_lines, snow_amplitude, snow_phase_rad
        Further lines that only lower the crest factor; the effective rms leaves out their power.

    Raises InputError naming the field.
    """

    sample_time_s: float
    n_samples: int
    lines: Lines
    amplitude: Real
    phase_rad: Real
    detection_lines: Lines = field(default_factory=_none)
    snow_lines: Lines = field(default_factory=_none)
    snow_amplitude: Real = field(default_factory=_nothing)
    snow_phase_rad: Real = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        """Check all fields and convert them to arrays."""
        object.__setattr__(self, "sample_time_s", positive("sample_time_s", self.sample_time_s))
        n = whole("n_samples", self.n_samples, 3, MOST_SAMPLES)
        object.__setattr__(self, "n_samples", n)
        for name in ("lines", "detection_lines", "snow_lines"):
            object.__setattr__(self, name, lines_below(name, getattr(self, name), n))
        for name in ("detection_lines", "snow_lines"):
            twice = np.intersect1d(self.lines, getattr(self, name))
            if twice.size:
                raise InputError(f"{name}: expected lines that are not excited, got {twice[0]}")
        if not len(self.lines):
            raise InputError("lines: expected at least one excited line, got none")
        sizes = {"": len(self.lines), "snow_": len(self.snow_lines)}
        for prefix, count in sizes.items():
            for name in (f"{prefix}amplitude", f"{prefix}phase_rad"):
                object.__setattr__(self, name, numbers(name, getattr(self, name), count))
        if np.any(self.snow_amplitude < 0):
            least = self.snow_amplitude.min()
            raise InputError(f"snow_amplitude: expected no negative number, got {least:g}")
        if np.any(self.snow_amplitude > LARGEST_SIZE):
            raise InputError(f"snow_amplitude: expected at most {LARGEST_SIZE:g}")
        usable = (self.amplitude >= SMALLEST_SIZE) & (self.amplitude <= LARGEST_SIZE)
        if not usable.all():
            at = int(np.argmin(usable))
            raise InputError(
                f"amplitude: expected positive numbers, got {self.amplitude[at]} at line "
                f"{self.lines[at]}; leave the line out instead"
            )

    @property
    def period_s(self) -> float:
        """Period T0 [s]."""
        return self.n_samples * self.sample_time_s

    @property
    def frequency_hz(self) -> Real:
        """Frequencies of the excited lines [Hz]."""
        return np.asarray(self.lines / self.period_s)

    @cached_property
    def period(self) -> Real:
        """The samples of one period, (n_samples,); sample n is at time n T."""
        spectrum = np.zeros(self.n_samples // 2 + 1, np.complex128)
        turned = 0.5 * self.n_samples / 1j
        spectrum[self.lines] = turned * self.amplitude * np.exp(1j * self.phase_rad)
        spectrum[self.snow_lines] = turned * self.snow_amplitude * np.exp(1j * self.snow_phase_rad)
        return np.fft.irfft(spectrum, self.n_samples)

    @property
    def rms(self) -> float:
        """Effective root mean square: that of the excited lines, without snow."""
        return float(np.sqrt(0.5 * np.sum(self.amplitude**2)))

    @cached_property
    def peak(self) -> float:
        """Largest absolute value, also between the samples.

        Evaluated on a grid of at least 64 samples per cycle of the highest line, 32 times its
        Nyquist count, with a parabola through the highest three; the relative error is below 1e-5.
        """
        snow = self.snow_amplitude > 0
        return _core.multisine_peak(
            [*self.lines.tolist(), *self.snow_lines[snow].tolist()],
            [*self.amplitude.tolist(), *self.snow_amplitude[snow].tolist()],
            [*self.phase_rad.tolist(), *self.snow_phase_rad[snow].tolist()],
        )

    @property
    def crest_factor(self) -> float:
        """Peak over effective rms."""
        return self.peak / self.rms

    def scaled(self, *, peak: float | None = None, rms: float | None = None) -> Multisine:
        """Return the signal with this peak or effective rms.

        Raises InputError unless exactly one of them is given.
        """
        if (peak is None) == (rms is None):
            raise InputError("peak, rms: expected exactly one of them")
        name, target, own = ("rms", rms, self.rms) if peak is None else ("peak", peak, self.peak)
        factor = size_of(name, target) / own
        return replace(
            self,
            amplitude=self.amplitude * factor,
            snow_amplitude=self.snow_amplitude * factor,
        )

    def through(self, response: ArrayLike) -> Multisine:
        """Return the steady-state output of a system with this ``response``, complex (n_lines,).

        The output has no snow or detection lines. Raises InputError for a response that is zero
        or not finite at a line.
        """
        gain = response_at(response, len(self.lines))
        return replace(
            self,
            amplitude=self.amplitude * np.abs(gain),
            phase_rad=self.phase_rad + np.angle(gain),
            snow_lines=_none(),
            snow_amplitude=_nothing(),
            snow_phase_rad=_nothing(),
        )


def response_at(response: ArrayLike, count: int) -> NDArray[np.complex128]:
    """Return a response at ``count`` lines, finite and not zero."""
    what = f"{count} finite complex numbers other than zero"
    gain = complexes("response", response, what, 1)
    if gain.shape != (count,) or np.any(gain == 0):
        got = f"shape {gain.shape}" if gain.shape != (count,) else "zero"
        raise InputError(f"response: expected {what}, got {got}")
    return gain


def multisine(
    period_s: float,
    sample_time_s: float,
    *,
    band_hz: tuple[float, float] | None = None,
    grid: Grid = "full",
    lines: ArrayLike | None = None,
    amplitude: ArrayLike | Callable[[Real], ArrayLike] = 1.0,
    phases: str | ArrayLike = "random",
    seed: int = 0,
    run: int = 0,
    group: int = 4,
) -> Multisine:
    """Return a multisine.

    Parameters
    ----------
    period_s : period T0 [s], a whole number of samples.
    sample_time_s : sample time [s].
    band_hz, grid, group : lines of a band as in :func:`line_set`.
    lines : the lines themselves, multiples of 1/T0. Give exactly one of ``band_hz`` and ``lines``.
    amplitude : one number, one per line, or a function of the frequencies [Hz]. Leave out lines of
        amplitude zero; they are refused.
    phases : ``"schroeder"`` (:func:`schroeder_phases`), ``"random"`` (uniform, a function of
        (seed, run), as in run number ``run`` of a Monte Carlo study), or one number [rad] per line.
    seed, run : determine random phases and the detection lines of ``"odd_random"``.

    Raises InputError naming the field.

    """
    n = whole_samples("period_s", period_s, sample_time_s)
    if (band_hz is None) == (lines is None):
        raise InputError("band_hz, lines: expected exactly one of them")
    detection = _none()
    if band_hz is not None:
        chosen, detection = line_set(
            period_s,
            sample_time_s,
            band_hz=band_hz,
            grid=grid,
            group=group,
            seed=seed,
            run=run,
        )
    else:
        chosen = lines_below("lines", lines, n)
        if not chosen.size:
            raise InputError("lines: expected at least one excited line, got none")
    sizes = amplitude(chosen / period_s) if callable(amplitude) else amplitude
    sizes = per_item("amplitude", sizes, len(chosen))
    return Multisine(
        sample_time_s=sample_time_s,
        n_samples=n,
        lines=chosen,
        amplitude=sizes,
        phase_rad=_phases(phases, sizes, seed, run),
        detection_lines=detection,
    )


def _phases(phases: str | ArrayLike, amplitude: Real, seed: int, run: int) -> Real:
    if not isinstance(phases, str):
        return numbers("phases", phases, len(amplitude))
    if phases == "schroeder":
        return schroeder_phases(amplitude)
    if phases == "random":
        return random_phases(len(amplitude), seed, run)
    raise InputError(f"phases: expected schroeder, random or numbers, got {phases!r}")


def schroeder_phases(amplitude: ArrayLike) -> Real:
    """Return Schroeder's phases [rad] for amplitudes (n_lines,).

    ``phi_k = -2 pi sum_{j<k} (k - j) p_j`` with p the shares of the power (Schroeder 1970);
    for a flat spectrum ``-k (k - 1) pi / F``, Wernholt (2004), section 5.4. Raises InputError for
    amplitudes that are all zero.
    """
    size = reals("amplitude", amplitude, "numbers of shape (n_lines,)", 1)
    if not np.any(size != 0):
        raise InputError("amplitude: expected one that is not zero, got zeros")
    power = (size / np.abs(size).max()) ** 2
    share = power / power.sum()
    delay = np.concatenate([[0.0], np.cumsum(share)[:-1]])
    return np.asarray(-2 * np.pi * np.cumsum(delay))


def random_phases(n_lines: int, seed: int, run: int = 0) -> Real:
    """Return phases [rad], (n_lines,), uniform over the circle, a function of (seed, run)."""
    return _core.random_phases(
        whole("n_lines", n_lines, 1, MOST_SAMPLES), seed_of("seed", seed), seed_of("run", run)
    )
