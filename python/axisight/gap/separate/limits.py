"""What motors may do in an experiment: the user's limits, else those of the robot's model, else what logs show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import reals
from axisight.errors import InputError
from axisight.excitation.checks import per_item
from axisight.gap.facts.experiment import MotionLimit, Source
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Largest torque and acceleration of a simulated motion, relative to the limit.
_MARGIN = 1.05
# Largest number of poses of a motion at which the room is checked.
_POSES = 200


@dataclass(frozen=True)
class ExperimentLimits:
    """Limits of the motors in an experiment; None for those of the robot's model, or else the ranges seen in the logs.

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
    without a limit. ``room`` (6,): as in `ExperimentLimits`. ``sources``: where speed, acceleration, travel and torque
    of each axis come from; without an entry, from the logs.
    """

    speed: Array
    back: Array
    forth: Array
    torque: Array
    acceleration: Array
    room: Array | None = None
    sources: Mapping[str, tuple[Source, ...]] = field(default_factory=dict)

    def told(self) -> tuple[MotionLimit, ...]:
        """Return the limits of speed, acceleration, travel and torque with their sources."""
        ends = {
            "speed": ("rad/s", -self.speed, self.speed),
            "acceleration": ("rad/s^2", -self.acceleration, self.acceleration),
            "travel": ("rad", self.back, self.forth),
            "torque": ("Nm", -self.torque, self.torque),
        }
        logs = _by_axis("logs", len(self.speed))
        return tuple(
            MotionLimit(name, unit, low, high, self.sources.get(name, logs))
            for name, (unit, low, high) in ends.items()
        )

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
    """Return what the motors may do: limits of the user, else of the robot's model, else the seen range.

    ``start`` (n_axes,): positions of the motors where the experiment begins [rad]. Travel that the user allows ends
    where the joint does. Raises InputError for limits that are not positive, whose number is neither one nor that of
    the axes, and for a room that is empty.
    """
    limits = limits or ExperimentLimits()
    given, stated = _given(limits, robot.n_axes), _of_model(robot)
    speed, of_speed = _chosen(seen.speed, given, stated, "velocity_rad_s")
    acceleration, of_acceleration = _chosen(seen.acceleration, given, stated, "acceleration_rad_s2")
    torque, of_torque = _chosen(seen.torque, given, stated, "torque_nm")
    back, forth, of_travel = _travel(seen, given.get("travel_rad"), robot, start)
    sources = {
        "speed": of_speed,
        "acceleration": of_acceleration,
        "travel": of_travel,
        "torque": of_torque,
    }
    room = None if limits.room_m is None else _room(limits.room_m)
    return Range(speed, back, forth, torque, acceleration, room, sources)


def _given(limits: ExperimentLimits, n_axes: int) -> dict[str, Array]:
    """Return the limits of the user by name, (n_axes,) each."""
    given: dict[str, Array] = {}
    for name in ("velocity_rad_s", "travel_rad", "torque_nm", "acceleration_rad_s2"):
        value = getattr(limits, name)
        if value is not None:
            where = f"limits of the experiment, {name}"
            given[name] = per_item(where, value, n_axes)
            if np.any(given[name] <= 0):
                raise InputError(f"{where}: expected positive numbers, got {value}")
    return given


def _of_model(robot: Robot) -> dict[str, Array]:
    """Return the limits of the joints on the motor side by name, (n_axes,) each; NaN where none is stated."""

    def each(name: str) -> Array:
        values = [getattr(limits, name) for limits in robot.joint_limits]
        return np.array([np.nan if x is None else x for x in values], float)

    ratio = np.abs(robot.gear_ratio)
    return {
        "velocity_rad_s": each("velocity") / ratio,
        "acceleration_rad_s2": each("acceleration") / ratio,
        "torque_nm": each("effort") * ratio,
    }


def _chosen(
    seen: Array, given: Mapping[str, Array], stated: Mapping[str, Array], name: str
) -> tuple[Array, tuple[Source, ...]]:
    """Return a limit (n_axes,) and the source of each axis: the user, else the model, else the logs."""
    if name in given:
        return given[name], _by_axis("given", len(seen))
    known = np.isfinite(stated[name])
    return np.where(known, stated[name], seen), _model_where(known, "logs")


def _by_axis(source: Source, n_axes: int) -> tuple[Source, ...]:
    return (source,) * n_axes


def _model_where(known: NDArray[np.bool_], otherwise: Source) -> tuple[Source, ...]:
    """Return the robot's model as the source of the axes where it is known, and another one elsewhere."""
    return tuple("model" if here else otherwise for here in known)


def _travel(
    seen: Range, given: Array | None, robot: Robot, start: Array
) -> tuple[Array, Array, tuple[Source, ...]]:
    """Return how far the motors may go back and forth from ``start`` [rad] (n_axes,), and the sources."""
    low, high = _joint_ends(robot)
    # A start beyond an end of the model is a matter of the logs, and leaves no travel that way.
    least, most = np.minimum(low - start, 0.0), np.maximum(high - start, 0.0)
    if given is None:
        known = np.isfinite(least)
        back, forth = np.where(known, least, seen.back), np.where(known, most, seen.forth)
        return back, forth, _model_where(known, "logs")
    back, forth = np.maximum(-given, least), np.minimum(given, most)
    cut = (back > -given) | (forth < given)
    return back, forth, _model_where(cut, "given")


def _joint_ends(robot: Robot) -> tuple[Array, Array]:
    """Return the ends of the joints' ranges on the motor side [rad], (n_axes,) each; infinite where none is stated."""
    low, high = np.full(robot.n_axes, -np.inf), np.full(robot.n_axes, np.inf)
    for axis, ends in enumerate(robot.joint_ranges):
        if ends is not None:
            low[axis], high[axis] = sorted(x / robot.gear_ratio[axis] for x in ends)
    return low, high


def _room(given: ArrayLike) -> Array:
    where, what = "limits of the experiment, room_m", "six numbers: lowest x, y, z, highest x, y, z"
    room = reals(where, given, what, 1)
    if room.shape != (6,) or np.any(room[:3] >= room[3:]):
        raise InputError(f"{where}: expected {what}, got {np.asarray(given).tolist()}")
    return room


def travel_of(logs: Sequence[Log], start: Array) -> tuple[Array, Array]:
    """Return how far the motors of logs go back and forth from ``start`` [rad], (n_axes,) each."""
    positions = [log.position_rad - start for log in logs]
    back = np.min([x.min(axis=0) for x in positions], axis=0)
    forth = np.max([x.max(axis=0) for x in positions], axis=0)
    return np.minimum(back, 0.0), np.maximum(forth, 0.0)
