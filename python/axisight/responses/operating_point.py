"""The operating point of experiments: mean joint angles, the same for all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from axisight.arguments import Real, instance, reals
from axisight.errors import InputError
from axisight.logs import Log
from axisight.robot import Robot

OPERATING_POINT = "joint_angle_rad"
"""Attribute of a response that holds its operating point: angles of the driven joints (rad)."""
GEAR_ANGLE = "gear_angle_rad"
"""Attribute that holds mean motor angles times gear ratio (rad)."""
GEAR_TORQUE = "gear_torque_nm"
"""Attribute that holds mean motor torques over gear ratio (Nm)."""

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
        if np.ptp(away) > swing[at] + beyond:
            unit = "rad" if turns else "m"
            raise InputError(
                f"{logs[worst].name}: operating point: expected mean position of axis {axis} as in the other "
                f"experiments, got means {np.ptp(away):.3g} {unit} apart, motor side; the motion itself is "
                f"{swing[at]:.3g} {unit}: estimate each operating point apart"
            )


def operating_point(
    logs: Sequence[Log], robot: Robot | None, *, torque_in_nm: bool
) -> dict[str, list[float]]:
    """Return the attributes of a response that state its operating point, means over all experiments.

    With joint encoders on all axes it is their mean. Otherwise it follows from motor positions with the gear
    ratios and gear stiffnesses of the robot (:func:`joint_angles`); the attributes ``gear_angle_rad`` and
    ``gear_torque_nm`` then allow to correct it with other stiffnesses. Without both the result is empty.
    ``torque_in_nm``: whether torques are torques, and no currents. Raises InputError if the robot has another
    number of axes.
    """
    if robot is not None and robot.n_axes != logs[0].n_axes:
        raise InputError(f"robot: expected {logs[0].n_axes} axes as the logs, got {robot.n_axes}")
    joints = [
        x for log in logs if (x := log.joint_position_rad) is not None and np.isfinite(x).all()
    ]
    if len(joints) == len(logs):
        return {OPERATING_POINT: _mean(joints)}
    if robot is None:
        return {}
    ratio = np.asarray(robot.gear_ratio)
    angle = np.array(_mean([log.position_rad for log in logs])) * ratio
    torque = np.zeros(robot.n_axes)
    if torque_in_nm:
        torque = np.nan_to_num(_mean([log.torque_nm for log in logs])) / ratio
    return {
        OPERATING_POINT: joint_angles(robot, angle, torque).tolist(),
        GEAR_ANGLE: angle.tolist(),
        GEAR_TORQUE: torque.tolist(),
    }


def joint_angles(robot: Robot, gear_angle_rad: ArrayLike, gear_torque_nm: ArrayLike) -> Real:
    """Return the angles of the driven joints, (n_axes,) [rad]: gear angles less the deflections of the gears.

    ``gear_angle_rad`` are motor angles times gear ratio, ``gear_torque_nm`` mean motor torques over gear
    ratio. A gear deflects by torque over stiffness; an axis without stiffness is rigid. Raises InputError for
    other shapes, and for numbers that are not finite.
    """
    instance("robot", robot, Robot)
    angle, torque = (
        _by_axis(field, given, robot.n_axes)
        for field, given in (("gear_angle_rad", gear_angle_rad), ("gear_torque_nm", gear_torque_nm))
    )
    known = robot.parameters()
    names = [robot.joint_names[joint] for joint in robot.axis_joints]
    stiffness = np.array([known.get(f"{name}.stiffness", 0.0) for name in names])
    deflection = np.divide(torque, stiffness, out=np.zeros_like(torque), where=stiffness > 0)
    return np.asarray(angle - deflection)


def _by_axis(field: str, given: object, n_axes: int) -> Real:
    found = reals(field, given, "numbers of shape (n_axes,)", 1)
    if len(found) != n_axes:
        raise InputError(f"{field}: expected {n_axes} numbers, one for each axis, got {len(found)}")
    return found


def _mean(signals: Sequence[Real]) -> list[float]:
    found: list[float] = np.mean([signal.mean(axis=0) for signal in signals], axis=0).tolist()
    return found
