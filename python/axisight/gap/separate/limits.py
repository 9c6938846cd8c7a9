"""What motors may do in an experiment: the range that logs show, with the user's limits in its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import reals
from axisight.errors import InputError
from axisight.excitation.checks import per_item
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Largest torque and acceleration of a simulated motion, relative to the limit.
_MARGIN = 1.05
# Largest number of poses of a motion at which the room is checked.
_POSES = 200


@dataclass(frozen=True)
class ExperimentLimits:
    """Limits of the motors in an experiment, in place of the ranges seen in the logs; None keeps the seen range.

    Largest absolute values on the motor side, one number for all axes or one for each: ``velocity_rad_s`` of the
    reference, ``acceleration_rad_s2``, ``travel_rad`` from the start of the experiment, ``torque_nm``.

    ``room_m``: lowest x, y, z and highest x, y, z [m] that the origin of the last link may reach, in the base frame;
    None if the joints may go wherever the travel allows.
    """

    velocity_rad_s: ArrayLike | None = None
    travel_rad: ArrayLike | None = None
    torque_nm: ArrayLike | None = None
    acceleration_rad_s2: ArrayLike | None = None
    room_m: ArrayLike | None = None


@dataclass(frozen=True)
class Range:
    """Range of the motors, (n_axes,) each.

    ``speed`` [rad/s], travel ``back`` and ``forth`` [rad], ``torque`` [Nm], ``acceleration`` [rad/s^2], infinite
    without a limit. ``room`` (6,): as in `ExperimentLimits`.
    """

    speed: Array
    back: Array
    forth: Array
    torque: Array
    acceleration: Array
    room: Array | None = None

    def allows(self, robot: Robot, start_rad: Array, motor_rad: Array, torque_nm: Array) -> bool:
        """Return whether a simulated run stays within torque, acceleration and room.

        ``start_rad`` (n_axes,): the motors where the experiment begins; ``motor_rad`` and ``torque_nm`` (n, n_axes)
        of the run, ``motor_rad`` from that start. A run that diverged is NaN, and stays within nothing.
        """
        if not (np.isfinite(motor_rad).all() and np.isfinite(torque_nm).all()):
            return False
        if np.any(np.abs(torque_nm).max(axis=0) > _MARGIN * self.torque):
            return False
        return self.room is None or _inside(robot, self.room, start_rad + motor_rad)


def _inside(robot: Robot, room: Array, motor_rad: Array) -> bool:
    """Return whether the origin of the last link stays in a room (6,)."""
    joints = np.array(robot.equilibrium()["joint_angle_rad"].values, float)
    for motor in motor_rad[:: max(1, len(motor_rad) // _POSES)]:
        joints[robot.axis_joints] = motor * robot.gear_ratio
        _, origin = robot.pose(joints)
        if np.any(origin < room[:3]) or np.any(origin > room[3:]):
            return False
    return True


def within_limits(
    seen: Range, limits: ExperimentLimits | None, robot: Robot, start: Array
) -> Range:
    """Return a seen range with the stated limits in its place, cut to the joint ranges of the robot's model.

    ``start`` (n_axes,): positions of the motors where the experiment begins [rad]. Raises InputError for limits that
    are not positive, whose number is neither one nor that of the axes, and for a room that is empty.
    """
    stated = seen if limits is None else _stated(seen, limits)
    low, high = _joint_ends(robot)
    # A start beyond an end of the model is a matter of the logs, and leaves no travel that way.
    back = np.maximum(stated.back, np.minimum(low - start, 0.0))
    forth = np.minimum(stated.forth, np.maximum(high - start, 0.0))
    return replace(stated, back=back, forth=forth)


def _joint_ends(robot: Robot) -> tuple[Array, Array]:
    """Return the ends of the joints' ranges on the motor side [rad], (n_axes,) each; infinite where none is stated."""
    low, high = np.full(robot.n_axes, -np.inf), np.full(robot.n_axes, np.inf)
    for axis, ends in enumerate(robot.joint_ranges):
        if ends is not None:
            low[axis], high[axis] = sorted(x / robot.gear_ratio[axis] for x in ends)
    return low, high


def _stated(seen: Range, limits: ExperimentLimits) -> Range:
    """Return the seen range with the stated limits in its place."""
    given: dict[str, Array] = {}
    for name in ("velocity_rad_s", "travel_rad", "torque_nm", "acceleration_rad_s2"):
        value = getattr(limits, name)
        if value is not None:
            field = f"limits of the experiment, {name}"
            given[name] = per_item(field, value, len(seen.speed))
            if np.any(given[name] <= 0):
                raise InputError(f"{field}: expected positive numbers, got {value}")
    travel = given.get("travel_rad")
    return Range(
        given.get("velocity_rad_s", seen.speed),
        seen.back if travel is None else -travel,
        seen.forth if travel is None else travel,
        given.get("torque_nm", seen.torque),
        given.get("acceleration_rad_s2", seen.acceleration),
        None if limits.room_m is None else _room(limits.room_m),
    )


def _room(given: ArrayLike) -> Array:
    field, what = "limits of the experiment, room_m", "six numbers: lowest x, y, z, highest x, y, z"
    room = reals(field, given, what, 1)
    if room.shape != (6,) or np.any(room[:3] >= room[3:]):
        raise InputError(f"{field}: expected {what}, got {np.asarray(given).tolist()}")
    return room


def travel_of(logs: Sequence[Log], start: Array) -> tuple[Array, Array]:
    """Return how far the motors of logs go back and forth from ``start`` [rad], (n_axes,) each."""
    positions = [log.position_rad - start for log in logs]
    back = np.min([x.min(axis=0) for x in positions], axis=0)
    forth = np.max([x.max(axis=0) for x in positions], axis=0)
    return np.minimum(back, 0.0), np.maximum(forth, 0.0)
