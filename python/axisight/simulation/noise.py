"""Noise of the position sensor as a function of seed and run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.robot import Robot

Array = NDArray[np.float64]

# Ranges of seed and run: 64 bits each in the core, of which the run leaves 16 to the axis.
_SEEDS, _RUNS = 1 << 64, 1 << 48


def _check_stream(seed: int, run: int) -> None:
    """Raise InputError for a seed or run out of the core's range."""
    for field, value, count in (("seed", seed, _SEEDS), ("run", run, _RUNS)):
        if not 0 <= value < count:
            bits = count.bit_length() - 1
            raise InputError(f"{field}: expected 0 to 2^{bits} - 1, got {value}")


def white_noise(seed: int, run: int, n_samples: int, n_axes: int) -> Array:
    """Return unit white Gaussian noise (n_samples, n_axes), a function of (``seed``, ``run``).

    Raises InputError for ``seed`` or ``run`` out of range. ``n_samples`` and ``n_axes`` set the shape.
    """
    _check_stream(seed, run)
    return _core.measurement_noise(seed, run, n_samples, n_axes, 1.0)


def sensor_noise(
    robot: Robot, seed: int, run: int, n_samples: int, cutoff_hz: float | None = None
) -> Array:
    """Return position noise (n_samples, n_axes) [rad] of the robot's sensor.

    The noise is a function of (``seed``, ``run``) with the standard deviation of the sensor. It is
    white, or of first order with corner ``cutoff_hz`` [Hz]. Raises InputError for a cutoff that is not
    positive.
    """
    std = robot.position_noise_std
    if cutoff_hz is None:
        return white_noise(seed, run, n_samples, robot.n_axes) * std
    _check_stream(seed, run)
    step = robot.sample_time_s
    return _core.measurement_noise(
        seed, run, n_samples, robot.n_axes, std, cutoff_hz=cutoff_hz, sample_time=step
    )
