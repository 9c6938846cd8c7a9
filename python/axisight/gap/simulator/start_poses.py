"""The pose where each simulation starts, if logs start at different poses, or the robot states none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.both_encoders import deflections_at_start
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Distance between start angles that counts as another pose [rad, joint side]. It changes gravity by a few per
# cent; elastic deflection under another load is a tenth of it.
OFFSET_RAD = 0.02
# Iterations for the start angle. Gravity deflection changes little with the pose: each step leaves 1 % of the
# error.
_STEPS = 3
SAYS = (
    "each log is simulated from the pose where it begins: poses differ, the robot file states none, or joint "
    "encoders show that joints do not stand where their motors do"
)


def at_their_poses(robot: Robot, logs: Sequence[Log]) -> list[Log]:
    """Return logs with the joint angles where their simulations start, if that is not the operating point.

    It is not where logs start at different poses, or away from an operating point that the robot does not state.
    All logs at one pose away from a stated operating point are a finding of the gate instead. Nor is it where
    encoders of motor and joint show an elastic gear that is deflected further at the start than the simulator's. Motors
    count as at rest at the first sample. Logs stay unchanged if the robot has no controller: it is not simulated along
    them. A log with a run-up keeps the start that this has.
    """
    if robot.controller_kind == "none" or any(log.n_axes != robot.n_axes for log in logs):
        # The gate refuses logs of another robot by name.
        return list(logs)
    begins = [log.position_rad[0] for log in logs if log.run_up is None]
    if begins and not robot.states_operating_point:
        begins.append(robot.operating_point / robot.gear_ratio)
    apart = np.ptp(begins, axis=0) * np.abs(robot.gear_ratio) if begins else np.zeros(1)
    elsewhere = bool(np.any(apart > OFFSET_RAD))
    deflected = deflections_at_start(logs, robot)
    return [
        log if log.run_up is not None else _at_its_pose(robot, log, elsewhere, bent)
        for log, bent in zip(logs, deflected, strict=True)
    ]


def _at_its_pose(robot: Robot, log: Log, elsewhere: bool, deflected_rad: Array) -> Log:
    """Return a log with the joint angles where its simulation starts.

    ``elsewhere``: not at the operating point; ``deflected_rad`` (n_axes,): deflection of the gears at the first sample,
    NaN where it is unknown.
    """
    angle = start_of(robot, log.position_rad[0]) if elsewhere else np.array(robot.operating_point)
    motor = robot.equilibrium(angle.tolist())["motor_angle_rad"].values
    further = deflected_rad - (motor * robot.gear_ratio - angle)
    # Only a gear that gives way lets a joint stand elsewhere than its motor.
    behind = (np.abs(further) > OFFSET_RAD) & ~np.array(robot.axis_is_rigid)
    if not elsewhere and not behind.any():
        return log
    return replace(log, start_rad=np.where(behind, angle - further, angle))


def start_of(robot: Robot, position_rad: Array) -> Array:
    """Return the driven joint angles [rad] that put the motors of a robot at rest at ``position_rad``, (n_axes,) each.

    Raises InputError if the arm does not settle.
    """
    angle = np.array(robot.operating_point, float)
    for _ in range(_STEPS):
        motor = robot.equilibrium(angle.tolist())["motor_angle_rad"].values
        angle = angle + (position_rad - motor) * robot.gear_ratio
    return angle


def starts_of(robot: Robot, logs: Sequence[Log]) -> list[list[float]] | None:
    """Return the start angles of the simulations (n_logs, n_axes) [rad]; None if all start at the operating point."""
    if all(log.start_rad is None for log in logs):
        return None
    rest = robot.operating_point
    return [(rest if log.start_rad is None else log.start_rad).tolist() for log in logs]
