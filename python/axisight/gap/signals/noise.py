"""The floor: what sensor noise leaves in the torque, and the weight of residuals it implies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.fitting import Weighting
from axisight.logs import Log

Array = NDArray[np.float64]

# Samples of a segment of which densities are averaged (Welch 1967).
_SEGMENT = 2048
# Samples of a log of which a tenth of the lines say little.
_SHORT = 4000


@dataclass(frozen=True)
class Floor:
    """Noise in the commanded torque of a closed loop.

    ``position_std_rad`` (n_axes,): standard deviation of the position noise;
    ``frequency_hz`` (n_freq,) and ``noise`` (n_axes, n_freq): torque noise
    density, scaled so that white noise has its variance; ``weighting``: whitens
    noise plus model error; ``expected`` (n_axes,): mean square of a weighted
    residual that is noise only.
    """

    position_std_rad: Array
    frequency_hz: Array
    noise: Array
    weighting: Weighting
    expected: Array


def position_noise_std(logs: list[Log]) -> Array:
    """Estimate white position noise (n_axes,) [rad] from the top fifth of the spectrum.

    Motion has no power there; what is left is the sensor. Median over the logs. Of short logs the top
    two fifths: a hundred lines are off by a twentieth, and a floor by a tenth.
    """
    estimates = [white_std(log.position_rad, log.sample_time_s) for log in logs]
    return np.asarray(np.median(np.array(estimates), axis=0))


def white_std(x: Array, sample_time_s: float) -> Array:
    """Return the standard deviation of white noise (n_axes,) on a signal (n, n_axes), as `position_noise_std`."""
    rate = 1.0 / sample_time_s
    # Twice differenced, motion is out of the way of leakage; white noise keeps its level.
    f, density = scipy.signal.welch(
        np.diff(x, n=2, axis=0), rate, nperseg=min(_SEGMENT, len(x) // 2), axis=0
    )
    top = (f > (0.4 if len(x) > _SHORT else 0.3) * rate) & (f < 0.49 * rate)
    gain = (2 * np.sin(np.pi * f[top] / rate)) ** 4
    return np.asarray(np.sqrt(np.mean(density[top] / gain[:, None], axis=0) * rate / 2))


def segment_of(log: Log) -> int:
    """Return the length of the segments that a spectrum of a log is averaged over."""
    return min(_SEGMENT, log.n_samples // 2)


SLOW = 2
"""First frequencies of a density of segments without their mean, which has next to nothing there."""
# Neighbouring frequencies that a density of noise is averaged over.
_NEIGHBOURS = 51


def smoothed(density: Array, shape: Array) -> Array:
    """Return a sampled density (n_axes, n_freq) with a smooth ratio to one of about its ``shape``.

    A density of few segments is off by a quarter at every frequency. Weights by its inverse would count
    noise most where it is said too small, and that noise alone leaves more than it is said to.
    """
    ratio = density / shape
    ratio[:, :SLOW] = ratio[:, [SLOW]]
    return np.asarray(shape * scipy.ndimage.uniform_filter1d(ratio, _NEIGHBOURS, mode="nearest"))


def torque_density(x: Array, rate: float, segment: int) -> tuple[Array, Array]:
    """Return frequencies and density (n_axes, n_freq), scaled so that white noise has its variance."""
    f, density = scipy.signal.welch(x, rate, nperseg=segment, axis=0, detrend="constant")
    return f, np.asarray(density.T * rate / 2)
