"""The operating point of experiments: mean joint angles, the same for all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.arguments import Real
from axisight.errors import InputError
from axisight.logs import Log
from axisight.robot import Robot

OPERATING_POINT = "joint_angle_rad"
"""Attribute of a response that holds its operating point: angles of the driven joints (rad)."""

# Experiments may start at another motor angle within a turn, so that ripple averages out.
_TURN_RAD = 2 * np.pi
# Largest difference of joint angles beyond the motion itself (rad): stiffness by pose changes by about 1 %.
_JOINT_RAD = 0.05


def expect_one_pose(logs: Sequence[Log], axes: Sequence[int], robot: Robot | None) -> None:
    """Raise InputError if the mean positions of experiments differ by more than motion and a motor turn.

    Of a revolute axis with a known gear, the difference may be 0.05 rad of the joint at most, beyond the
    motion of the axis.
    """
    mean = np.array([log.position_rad.mean(axis=0) for log in logs])
    swing = np.max([np.ptp(log.position_rad, axis=0) for log in logs], axis=0)
    for axis in axes:
        at = axis - 1
        away = mean[:, at] - np.median(mean[:, at])
        worst = int(np.argmax(np.abs(away)))
        turns = logs[0].axis_kinds[at] == "revolute"
        beyond = _TURN_RAD if turns else 0.0
        if robot is not None and turns:
            beyond = min(beyond, _JOINT_RAD / abs(float(robot.gear_ratio[at])))
        if abs(away[worst]) > swing[at] + beyond:
            unit = "rad" if turns else "m"
            raise InputError(
                f"{logs[worst].name}: operating point: expected mean position of axis {axis} as in the other "
                f"experiments, got {abs(away[worst]):.3g} {unit} off, motor side; the motion itself is "
                f"{swing[at]:.3g} {unit}: estimate each operating point apart"
            )


def mean_joint_angles(logs: Sequence[Log], robot: Robot | None) -> Real | None:
    """Return the mean joint positions over all experiments, (n_axes,) [rad; m if prismatic].

    From joint encoders if all axes have one, else from motor positions with the gear ratios of the robot;
    None without both. Motor positions miss the deflection of loaded gears, some mrad.
    Raises InputError if the robot has another number of axes.
    """
    if robot is not None and robot.n_axes != logs[0].n_axes:
        raise InputError(f"robot: expected {logs[0].n_axes} axes as the logs, got {robot.n_axes}")
    joints = [log.joint_position_rad for log in logs]
    if all(found is not None and np.isfinite(found).all() for found in joints):
        return np.asarray(np.mean([np.mean(found, axis=0) for found in joints if found is not None], axis=0))
    if robot is None:
        return None
    motors = np.mean([log.position_rad.mean(axis=0) for log in logs], axis=0)
    return np.asarray(motors * robot.gear_ratio)
