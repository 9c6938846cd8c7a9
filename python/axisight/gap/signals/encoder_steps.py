"""Steps of encoders that are coarser than the noise of the stated sensor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.effects.stated import STEPS
from axisight.logs import Log
from axisight.logs.quality import quantization
from axisight.robot import Robot

Array = NDArray[np.float64]

OF_A_STEP = 0.01
"""Largest relative difference between the steps of one encoder in several logs."""


def encoder_steps(robot: Robot, logs: Sequence[Log]) -> Array:
    """Return the step of each axis' position (n_axes,) [rad] if its noise exceeds the stated sensor noise; else zero.

    Zero too if the simulator has encoder steps on that axis, if a log shows none, or if the steps of the logs
    differ by more than 1 %.
    """
    known = {e.axis for e in robot.effects if e.name == STEPS[0] and e.acts}
    out = np.zeros(robot.n_axes)
    for i in range(robot.n_axes):
        found = [quantization(log.position_rad[:, i]) for log in logs]
        steps = [0.0 if q is None else q.step for q in found]
        felt = 0 < robot.position_noise_std < min(steps) / np.sqrt(12.0)
        alike = max(steps) < (1 + OF_A_STEP) * min(steps)
        if felt and alike and i + 1 not in known:
            out[i] = float(np.median(steps))
    return out


def as_effect(axis: int, step_rad: float) -> Effect:
    """Return encoder steps of ``step_rad`` [rad] on an axis (from 0) as an effect."""
    name, increment = STEPS
    return Effect(name, axis + 1, {increment: step_rad})
