"""Where runs begin: each at its own pose, where logs of one robot begin at several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Joint angle between starts that changes gravity by a few per cent; a tenth of it is elastic
# deflection under another load.
OFFSET_RAD = 0.02
# Deflections under gravity change little with the pose: each step leaves a hundredth of the error.
_STEPS = 3
SAYS = (
    "the logs begin at different poses: each is simulated from its own, where its first position is"
)


def at_their_poses(robot: Robot, logs: Sequence[Log]) -> list[Log]:
    """Return logs with the angles that a simulation of each starts at, where they begin at several poses.

    Logs that all begin at one pose are returned as they are: beside the operating point that is a
    finding; so are those of a robot without a controller, which is not simulated along them. Positions
    are those of motors at rest. One with a run-up has its own.
    """
    if robot.controller_kind == "none" or any(log.n_axes != robot.n_axes for log in logs):
        # Logs of another robot are refused, by name, where all faults are looked for.
        return list(logs)
    begins = np.array([log.position_rad[0] for log in logs if log.run_up is None])
    apart = np.ptp(begins, axis=0) * np.abs(robot.gear_ratio) if len(begins) else np.zeros(1)
    if not np.any(apart > OFFSET_RAD):
        return list(logs)
    return [
        log
        if log.run_up is not None
        else replace(log, start_rad=start_of(robot, log.position_rad[0]))
        for log in logs
    ]


def start_of(robot: Robot, position_rad: Array) -> Array:
    """Return the driven joint angles [rad] at which the motors of a robot at rest are at ``position_rad``.

    Both (n_axes,). Raises InputError where the arm does not settle.
    """
    angle = np.array(robot.operating_point, float)
    for _ in range(_STEPS):
        motor = robot.equilibrium(angle.tolist())["motor_angle_rad"].values
        angle = angle + (position_rad - motor) * robot.gear_ratio
    return angle


def starts_of(robot: Robot, logs: Sequence[Log]) -> list[list[float]] | None:
    """Return where simulations of logs start [rad], (n_logs, n_axes); None where all do at the operating point."""
    if all(log.start_rad is None for log in logs):
        return None
    rest = robot.operating_point
    return [(rest if log.start_rad is None else log.start_rad).tolist() for log in logs]
