"""Pose in which each log begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from axisight.logs import Log
from axisight.robot import Robot

_ROUNDS = 3


def from_its_start(robot: Robot, log: Log) -> Log:
    """Return the log with the driven joint angles at its start, if it does not state them.

    They follow from the first motor position and, by the present model, the deflection of the gears under
    gravity there. The noise of one reading does not matter, as a gear divides it by its ratio.
    """
    if log.start_rad is not None:
        return log
    motor = log.position_rad[0]
    angle = motor * robot.gear_ratio
    # The deflection hardly depends on the angle, so that each round divides the error by a thousand.
    for _ in range(_ROUNDS):
        held = robot.equilibrium(angle.tolist())["motor_angle_rad"].values
        angle = angle - (held - motor) * robot.gear_ratio
    return replace(log, start_rad=angle)


def mean_angle(
    robot: Robot, log: Log, kept_s: float
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the mean driven joint angles (n_axes,) [rad] over the last ``kept_s`` [s] of a log."""
    count = max(1, round(kept_s / log.sample_time_s))
    mean = log.position_rad[-count:].mean(axis=0) * robot.gear_ratio
    return np.asarray(mean, dtype=np.float64)
