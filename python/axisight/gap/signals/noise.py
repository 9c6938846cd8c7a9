"""The floor: torque from sensor noise, and the weights of residuals that follow from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.fitting import Weighting
from axisight.logs import Log
from axisight.statistics.spectral_density import welch

Array = NDArray[np.float64]

# Largest number of samples in a segment of a spectral density (Welch 1967).
_SEGMENT = 2048
# Number of samples up to which a log has too few frequencies in the top fifth of its spectrum; it uses the top
# two fifths.
_SHORT = 4000


@dataclass(frozen=True)
class Floor:
    """Noise in the commanded torque of a closed loop.

    - ``position_std_rad`` (n_axes,): standard deviation of the position noise.
    - ``frequency_hz`` (n_freq,), ``noise`` (n_axes, n_freq): density of the torque noise, scaled so that white
      noise has its variance.
    - ``weighting``: whitens noise plus model error.
    - ``expected`` (n_axes,): mean square of a weighted residual that is noise only.
    """

    position_std_rad: Array
    frequency_hz: Array
    noise: Array
    weighting: Weighting
    expected: Array


def position_noise_std(logs: list[Log]) -> Array:
    """Estimate white position noise (n_axes,) [rad] from the top fifth of the spectrum, the median over the logs.

    Motion has no power there. For short logs the top two fifths are used: with one hundred frequencies the
    estimate is off by 5 %, and the floor by 10 %.
    """
    estimates = [white_std(log.position_rad, log.sample_time_s) for log in logs]
    return np.asarray(np.median(np.array(estimates), axis=0))


def white_std(x: Array, sample_time_s: float) -> Array:
    """Return the standard deviation of white noise (n_axes,) on a signal (n, n_axes), as in `position_noise_std`."""
    rate = 1.0 / sample_time_s
    # Second differences remove slow motion, which would leak into the top; white noise stays.
    f, density = welch(np.diff(x, n=2, axis=0), rate, min(_SEGMENT, len(x) // 2))
    top = (f > (0.4 if len(x) > _SHORT else 0.3) * rate) & (f < 0.49 * rate)
    gain = (2 * np.sin(np.pi * f[top] / rate)) ** 4
    return np.asarray(np.sqrt(np.mean(density[top] / gain[:, None], axis=0) * rate / 2))


def segment_of(log: Log) -> int:
    """Return the number of samples in a segment of a log's spectral density."""
    return min(_SEGMENT, log.n_samples // 2)


SLOW = 2
"""Number of the lowest frequencies where the density has almost no power, since each segment's mean is taken off."""
# Number of neighbouring frequencies in the average of a noise density.
_NEIGHBOURS = 51


def smoothed(density: Array, shape: Array) -> Array:
    """Return a sampled density (n_axes, n_freq), smoothed as a ratio to a density of similar ``shape``.

    With few segments a density is off by 25 % at each frequency. Weights by its inverse would be largest where
    it is too small, and noise alone would leave a residual above the expected one.
    """
    ratio = density / shape
    ratio[:, :SLOW] = ratio[:, [SLOW]]
    return np.asarray(shape * scipy.ndimage.uniform_filter1d(ratio, _NEIGHBOURS, mode="nearest"))


def torque_density(x: Array, rate: float, segment: int) -> tuple[Array, Array]:
    """Return frequencies [Hz] and density (n_axes, n_freq), scaled so that white noise has its variance."""
    f, density = welch(x, rate, segment)
    return f, np.asarray(density.T * rate / 2)
