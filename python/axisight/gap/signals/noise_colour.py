"""The colour of the noise on a torque or a velocity: white, or rising with frequency as a differentiated encoder's.

A control loop that differentiates an encoder puts noise into the torque whose density rises with the square of the
frequency. Its top is no measure of the band of the motion below.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.signals.noise import segment_of
from axisight.logs import Log
from axisight.statistics.spectral_density import welch

Array = NDArray[np.float64]

# Share of the smallest squared differences that is averaged; the rest may contain breaks.
_KEPT = 0.9
# Mean square of the smallest 90 % of standard normal numbers, of third differences of unit white noise, and of third
# differences of differentiated unit white noise.
_VARIANCE_KEPT, _THIRD, _FOURTH = 0.6230, 20.0, 70.0


@dataclass(frozen=True)
class NoiseColour:
    """White noise, plus white noise that was differentiated once from sample to sample.

    ``white`` (n_axes,): standard deviation of the first; ``stepwise`` (n_axes,): of the second before it was
    differentiated.
    """

    white: Array
    stepwise: Array

    def drawn(self, unit: Array) -> Array:
        """Return noise (n, n_axes) of this colour from unit white noise (2 n, n_axes)."""
        n = len(unit) // 2
        return np.asarray(self.white * unit[:n] + self.stepwise * np.diff(unit[n - 1 :], axis=0))


def noise_colour(log: Log, x: Array, above_hz: float) -> NoiseColour:
    """Return the noise on a signal (n, n_axes) of a log; ``above_hz``: where the band of the motion ends.

    The noise is white, as large as the top fifth of the spectrum, unless the density between ``above_hz`` and the top
    rises with frequency: the Bayesian information criterion decides (Schwarz 1978, Annals of Statistics 6(2)). Dry
    friction breaks a torque at every reversal, which adds power everywhere. The estimate is therefore limited to that
    from sample-to-sample differences without the largest ones. A log too short for a frequency in the top fifth has its
    highest one for it. Raises InputError for fewer than six samples: there is none.
    """
    rate = 1.0 / log.sample_time_s
    segment = segment_of(log)
    f, density = welch(x, rate, segment)
    density *= rate / 2
    known = (f > 0.0) & (f < 0.49 * rate)
    if not known.any():
        raise InputError(
            f"{log.name}: samples: expected at least 6 to tell noise from motion, got {log.n_samples}"
        )
    top = known & (f > 0.4 * rate)
    if not top.any():
        top = f == f[known].max()
    # A tenth of the rate: below it, a log of many samples has few of its frequencies.
    low = min(max(above_hz, 0.1 * rate), 0.4 * rate)
    seen = known & (f > low) | top
    gain = (2 * np.sin(np.pi * f / rate)) ** 2
    white, stepwise = density[top].mean(axis=0), np.zeros(x.shape[1])
    for axis in range(x.shape[1]):
        flat, rising = _rising(density[seen, axis], gain[seen], log.n_samples / segment)
        # Power of the motion beside the noise raises the fit, not the top.
        over = (flat + rising * gain[top].mean()) / max(white[axis], 1e-300)
        if rising > 0.0:
            white[axis], stepwise[axis] = np.array([flat, rising]) / max(over, 1.0)
    limit = _unbroken(x) / np.maximum(_THIRD * white + _FOURTH * stepwise, 1e-300)
    share = np.sqrt(np.minimum(limit, 1.0))
    return NoiseColour(share * np.sqrt(white), share * np.sqrt(stepwise))


def _rising(density: Array, gain: Array, segments: float) -> tuple[float, float]:
    """Return the densities of white noise and of noise times ``gain``; the second is zero if none is sure.

    ``density``, ``gain`` (n_freq,); ``segments``: number of segments in the density. Medians of narrow bands are
    fitted, so that a line of the mains or of a switching frequency counts little. Least squares, weighted by the
    fitted density, is the maximum of Whittle's likelihood.
    """
    # As many bands as frequencies in each.
    count = int(np.sqrt(len(density)))
    bands = np.array_split(np.arange(len(density)), count)
    # Median of a mean of squares over its expectation (Wilson and Hilferty 1931).
    y = np.array([np.median(density[b]) for b in bands]) / (1 - 1 / (9 * segments)) ** 3
    columns = np.column_stack([np.ones(count), [gain[b].mean() for b in bands]])
    whole = float(y.mean())
    if not whole > 0.0:
        return 0.0, 0.0
    if count == 1:
        # One band is white and rising alike.
        return whole, 0.0
    model, found = np.full(count, whole), np.zeros(2)
    for _ in range(10):
        found, _ = scipy.optimize.nnls(columns / model[:, None], y / model)
        model = np.maximum(columns @ found, 1e-12 * whole)
    # A median scatters as a mean of 2 / pi as many numbers does.
    weight = 2.0 * segments * len(density) / count * 2 / np.pi
    flat, coloured = (
        weight * float(np.sum(y / m + np.log(m))) for m in (np.full(count, whole), model)
    )
    sure = coloured + np.log(len(density)) < flat
    return (float(found[0]), float(found[1])) if sure else (whole, 0.0)


def _unbroken(x: Array) -> Array:
    """Return the mean square (n_axes,) of the third differences of a signal, from the smaller ones."""
    squares = np.sort(np.diff(x, 3, axis=0) ** 2, axis=0)
    kept = squares[: max(1, int(_KEPT * len(squares)))].mean(axis=0)
    return np.asarray(kept / _VARIANCE_KEPT)
