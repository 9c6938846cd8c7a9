"""The cutoff of the low-pass in inverse dynamics, from the data."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.logs import Log

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array, Array]

# Below the first resonance of most machines, above the spectrum of their motions.
_HIGHEST_HZ = 60.0
_LOWEST_HZ = 2.0
# A log has at least this many samples in a period of the cutoff.
_OVERSAMPLING = 5.0
# Corner of the sign of the speed, as a share of the largest speed.
_CORNER = 0.01


def highest_cutoff_hz(sample_time_s: float) -> float:
    """Return the highest cutoff that is worth trying at a sample time."""
    return min(_HIGHEST_HZ, 1 / (_OVERSAMPLING * sample_time_s))


def chosen_cutoff_hz(
    logs: Sequence[Log],
    motion: Callable[[Log, float], Motion],
    predict: Callable[[Motion], Array],
) -> float:
    """Return the cutoff whose motion predicts torque best on data left out, in half octaves.

    ``motion(log, cutoff)`` is the low-passed motion and torque, ``predict`` the torque of the
    rigid simulator along it. On every axis the torque *as logged* is regressed on the predicted
    one, the speed, its sign and an offset, on one half of each log, and predicted on the other:
    what a low cutoff takes from the motion and what a high one leaves of the noise both count.
    """
    count = int(2 * np.log2(highest_cutoff_hz(logs[0].sample_time_s) / _LOWEST_HZ)) + 1
    grid = highest_cutoff_hz(logs[0].sample_time_s) * 2.0 ** (-np.arange(max(count, 1)) / 2)
    errors = [_held_out_error(logs, motion, predict, float(cutoff)) for cutoff in grid]
    return float(grid[int(np.argmin(errors))])


def _held_out_error(
    logs: Sequence[Log],
    motion: Callable[[Log, float], Motion],
    predict: Callable[[Motion], Array],
    cutoff_hz: float,
) -> float:
    """Return the sum over axes of the squared error on the other half, relative to the torque's."""
    moved = [motion(log, cutoff_hz) for log in logs]
    rigid = np.concatenate([predict(m) for m in moved])
    speed = np.concatenate([m[1] for m in moved])
    torque = np.concatenate([log.torque_nm for log in logs])
    late = np.concatenate([2 * np.arange(log.n_samples) >= log.n_samples for log in logs])
    total = 0.0
    for axis in range(torque.shape[1]):
        v, y = speed[:, axis], torque[:, axis]
        corner = _CORNER * max(float(np.abs(v).max()), 1e-12)
        sign = v / np.sqrt(v**2 + corner**2)
        x = np.stack([rigid[:, axis], v, sign, np.ones(len(v))], axis=1)
        squares = 0.0
        for half in (late, ~late):
            theta = np.linalg.lstsq(x[half], y[half], rcond=None)[0]
            squares += float(((y[~half] - x[~half] @ theta) ** 2).sum())
        total += squares / max(float(y.var()), 1e-300)
    return total
