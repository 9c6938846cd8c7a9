"""Find the DFT lines that an excitation excites, from the part that repeats from period to period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from axisight.arguments import Lines, Real, between, number, reals
from axisight.display.summary import summarized
from axisight.errors import InputError

_HALF_WIDTH = 10  # lines on either side that share one noise level
_CLEAR_GAP_DB, _LEAST_ABOVE = (
    10.0,
    10,
)  # a gap between levels that separates excited lines from others
_LOWEST_DB = -60.0  # weaker lines are no part of what comes close to the excitation
_SHAPE = "numbers of shape (n_experiments, n_periods, n_samples, n_channels)"


@summarized
@dataclass(frozen=True)
class ExcitedLines:
    """Lines found to be excited.

    lines
        Excited lines k, ascending.
    margin_db
        Level of the weakest excited line over the strongest other line, or over rounding errors if these are
        stronger [dB].
    """

    lines: Lines
    margin_db: float


def repeating_lines(periods: Real, significance: float = 1e-4) -> NDArray[np.bool_]:
    """Return a mask (n_samples // 2 + 1,) of the lines whose amplitude exceeds the noise.

    ``periods`` has shape (n_periods, n_samples), at least two periods. At each line an F test compares the
    squared mean over the periods with its variance. Without repetition, P |mean|^2 / s^2 follows
    F(2, 2 M (P - 1)) with s^2 pooled over M neighbouring lines. ``significance`` is the probability of one
    false line among all of them (Bonferroni). Line 0 is never reported.

    Raises InputError for fewer than two periods, values that are not finite, and a significance that is not
    between 0 and 1.
    """
    periods = reals("periods", periods, "numbers of shape (n_periods, n_samples)", 2)
    significance = between("significance", significance, 0, 1)
    n_periods = len(periods)
    if n_periods < 2:
        raise InputError(
            f"periods: expected at least two to tell noise from lines, got {n_periods}"
        )
    spectra = np.fft.rfft(periods, axis=1)
    mean = np.abs(spectra.mean(0)) ** 2
    variance = np.var(spectra, axis=0, ddof=1)
    width = min(2 * _HALF_WIDTH + 1, len(variance))
    pooled = np.maximum(uniform_filter1d(variance, width, mode="nearest"), _rounding(mean))
    degrees = 2 * width * (n_periods - 1)
    limit = scipy.stats.f.isf(significance / len(mean), 2, degrees)
    found: NDArray[np.bool_] = n_periods * mean > limit * pooled
    found[0] = False
    return found


def excited_lines(signal: Real, *, floor_db: float = -40.0) -> ExcitedLines:
    """Return the excited lines of a reference (or input) in whole periods.

    signal
        Array (n_experiments, n_periods, n_samples, n_channels). A line counts if any experiment and channel
        excites it.
    floor_db
        Least level of a line relative to the strongest line of its channel [dB]. Weaker lines do not count,
        because distortion and quantization repeat as well.

    With two periods or more, a line must also exceed the noise (:func:`repeating_lines`).
    The line at Nyquist is never reported.

    Raises InputError if nothing is excited, for a floor that is not below 0 dB, and for fewer than three
    samples per period.
    """
    signal = reals("signal", signal, _SHAPE, 4)
    floor_db = number("floor_db", floor_db)
    if floor_db >= 0:
        raise InputError(f"floor_db: expected below zero, got {floor_db}")
    relative = _relative(signal)
    n_experiments, n_periods, _, n_channels = signal.shape
    n_lines = relative.shape[1]
    found = relative > 10 ** (floor_db / 20)
    if n_periods >= 2:
        for e in range(n_experiments):
            for c in range(n_channels):
                found[e, :, c] &= repeating_lines(signal[e, :, :, c])[:n_lines]
    any_found = found.any(axis=(0, 2))
    if not any_found.any():
        raise InputError("reference: expected an excitation, got no line above the noise")
    level = relative.max(axis=(0, 2))
    others = np.append(level[~any_found], 1e-15).max()
    margin = 20 * np.log10(level[any_found].min() / max(others, 1e-15))
    return ExcitedLines(np.flatnonzero(any_found).astype(np.int64), float(margin))


def widest_gap(signal: Real) -> float | None:
    """Return a floor [dB] in the widest gap between the levels of lines; None without a clear gap.

    ``signal`` is that of :func:`excited_lines`. A clear gap is at least 10 dB wide, with at least 10 lines above
    it and lines below it that are within 60 dB of the strongest. Use it where distortion or noise is within
    40 dB of the strongest line.
    """
    level = _relative(reals("signal", signal, _SHAPE, 4)).max(axis=(0, 2))
    ordered = 20 * np.log10(np.sort(level[level > 10 ** (_LOWEST_DB / 20)])[::-1])
    gaps = -np.diff(ordered)[_LEAST_ABOVE - 1 :]
    if not gaps.size or gaps.max() < _CLEAR_GAP_DB:
        return None
    at = int(np.argmax(gaps)) + _LEAST_ABOVE - 1
    return float((ordered[at] + ordered[at + 1]) / 2)


def _relative(signal: Real) -> Real:
    """Return the level of each line relative to the strongest of its channel, (experiment, line, channel)."""
    n_samples = signal.shape[2]
    if n_samples < 3:
        raise InputError(f"signal: expected three samples a period or more, got {n_samples}")
    spectra = np.abs(np.fft.rfft(signal.mean(1), axis=1))[:, : (n_samples + 1) // 2]
    spectra[:, 0] = 0.0
    strongest = spectra.max(axis=1, keepdims=True)
    # A channel at rest contains only rounding errors and crosstalk, which would count relative to itself.
    active = strongest > 1e-6 * strongest.max()
    return np.asarray(np.where(active, spectra / np.where(active, strongest, 1.0), 0.0))


def _rounding(power: Real) -> float:
    """Return the power of rounding errors at one line of a signal with these line powers."""
    return float((1e-13**2) * power.sum()) + np.finfo(float).tiny
