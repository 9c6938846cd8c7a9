"""Deflection of gears, where a log has positions of motor and joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.lowpass_cutoff import highest_cutoff_hz
from axisight.gap.signals.standstill import EACH_WAY
from axisight.logs import Log, differentiate, lowpass
from axisight.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Swing:
    """How far a gear deflects as the torque in it changes its direction, to either side [rad, joint side].

    - ``measured_rad``: half the distance between the medians under torque one way and the other.
    - ``simulated_rad``: the same for the torque over the simulator's stiffness; zero for a rigid gear.
    - ``play_rad``: the part of ``measured_rad`` that does not grow with the torque; impacts in the gap make it smaller.
    - ``middle_rad``: the deflection without torque, in the middle of the play. It is zero for encoders of one zero.
    """

    measured_rad: float
    simulated_rad: float
    play_rad: float
    middle_rad: float


def deflection(log: Log, robot: Robot) -> Array | None:
    """Return the deflection of the gears (n, n_axes) [rad, joint side], about its median; None if not measured.

    Encoders count from zeros of their own, so only changes mean something. NaN on axes without a joint encoder.
    """
    if log.joint_position_rad is None:
        return None
    apart = _between_encoders(log, robot)
    return np.asarray(apart - np.median(apart, axis=0))


def _between_encoders(log: Log, robot: Robot) -> Array:
    """Return the angle between the encoders of a log with joint encoders (n, n_axes) [rad, joint side]."""
    assert log.joint_position_rad is not None  # checked before
    return np.asarray(log.position_rad * robot.gear_ratio - log.joint_position_rad)


def deflections_at_start(logs: Sequence[Log], robot: Robot) -> Array:
    """Return the deflection of the gears at the first sample of each log (n_logs, n_axes) [rad, joint side].

    The zero of a joint encoder shows in logs whose torque turns round, and is the same in all. NaN where it does not
    show, and on axes without a joint encoder.
    """
    seen = np.full((len(logs), robot.n_axes), np.nan)
    at = seen.copy()
    for k, log in enumerate(logs):
        if log.joint_position_rad is not None:
            at[k] = _between_encoders(log, robot)[0]
            seen[k] = [np.nan if s is None else s.middle_rad for s in swings(log, robot)]
    zero = [np.median(x[np.isfinite(x)]) if np.isfinite(x).any() else np.nan for x in seen.T]
    return np.asarray(at - np.array(zero))


def play_rad(logs: Sequence[Log], robot: Robot, index: int) -> float:
    """Return the largest play [rad, joint side] of an axis (from 0) that a log shows; zero if none does.

    That is what the simulator's stiffness leaves of the deflection, if much of it does not grow with the torque.
    """
    seen = [swing for log in logs if (swing := swings(log, robot)[index]) is not None]
    left = [s.measured_rad - s.simulated_rad for s in seen if s.play_rad > 0]
    steady = max((swing.play_rad for swing in seen), default=0.0)
    # Impacts between the teeth blur the steady part to half.
    widest = max(left, default=0.0)
    return widest if steady > 0.25 * widest else 0.0


def swings(log: Log, robot: Robot) -> list[Swing | None]:
    """Return the swing of every gear in a log; None without a joint encoder, or if the torque never turns round."""
    stiffness = stiffnesses(robot)
    return [
        None if bends is None else _swing(bends, stiffness[i])
        for i, bends in enumerate(bends_of(log, robot))
    ]


@dataclass(frozen=True)
class Bend:
    """Deflection of a gear under torques of about one size, to either side.

    - ``deflection_rad``, ``torque_nm``: half the distance between the medians under torque one way and the other.
    - ``middle_rad``, ``middle_nm``: the middle between these medians.
    - ``scatter_rad``: median distance of the deflections from the law of both sizes.
    """

    deflection_rad: float
    torque_nm: float
    middle_rad: float
    middle_nm: float
    scatter_rad: float = 0.0


def bends_of(log: Log, robot: Robot) -> list[tuple[Bend, Bend] | None]:
    """Return the deflection of every gear in a log under weak and under strong torque, joint side.

    None for an axis without a joint encoder, and for one whose torque never turns round. Weak torque is the third
    quarter by size, strong torque the last one.
    """
    if log.joint_position_rad is None:
        return [None] * robot.n_axes
    apart, torque = _between_encoders(log, robot), joint_torque(log, robot)
    return [bends_along(apart[:, i], torque[:, i]) for i in range(robot.n_axes)]


def bends_along(apart: Array, torque: Array) -> tuple[Bend, Bend] | None:
    """Return the bends (weak, strong) of one gear from its deflection and torque (n,); None as in `bends_of`."""
    if not np.isfinite(apart).all():
        return None
    size = np.abs(torque)
    small, large = np.quantile(size, [0.5, 0.75])
    chosen = [(size > small) & (size <= large), size > large]
    weak, strong = (_to_either_side(apart, torque, x) for x in chosen)
    if weak is None or strong is None:
        return None
    slope = _slope(weak, strong)

    def scatter(bend: Bend, which: NDArray[np.bool_]) -> float:
        way = np.sign(torque[which])
        load = torque[which] - bend.middle_nm - way * bend.torque_nm
        at = bend.middle_rad + way * bend.deflection_rad + slope * load
        return float(np.median(np.abs(apart[which] - at)))

    first, second = (
        replace(x, scatter_rad=scatter(x, which))
        for x, which in zip((weak, strong), chosen, strict=True)
    )
    return first, second


def _slope(weak: Bend, strong: Bend) -> float:
    """Return by how much the deflection grows with the torque [rad/Nm]."""
    return (strong.deflection_rad - weak.deflection_rad) / (strong.torque_nm - weak.torque_nm)


def _swing(bends: tuple[Bend, Bend], stiffness: float) -> Swing:
    weak, strong = bends
    # A line through both: what is left of it without torque is play.
    slope = _slope(weak, strong)
    play = min(max(weak.deflection_rad - slope * weak.torque_nm, 0.0), strong.deflection_rad)
    middle = strong.middle_rad - slope * strong.middle_nm
    return Swing(strong.deflection_rad, strong.torque_nm / stiffness, play, middle)


def _to_either_side(apart: Array, torque: Array, chosen: NDArray[np.bool_]) -> Bend | None:
    """Return the deflection under the ``chosen`` samples' torque, without its scatter; None if it acts one way only."""
    ways = [chosen & (torque > 0), chosen & (torque < 0)]
    if min(float(way.mean()) for way in ways) < EACH_WAY:
        return None
    bent, load = ([float(np.median(x[way])) for way in ways] for x in (apart, torque))
    return Bend(
        deflection_rad=0.5 * (bent[0] - bent[1]),
        torque_nm=0.5 * (load[0] - load[1]),
        middle_rad=0.5 * (bent[0] + bent[1]),
        middle_nm=0.5 * (load[0] + load[1]),
    )


def joint_torque(log: Log, robot: Robot) -> Array:
    """Return the torque that links and gravity take from the gears (n, n_axes) [Nm, joint side]."""
    angle = log.position_rad * robot.gear_ratio
    moved = angle
    if log.joint_position_rad is not None:
        moved = np.where(np.isfinite(log.joint_position_rad), log.joint_position_rad, angle)
    cutoff = highest_cutoff_hz(log.sample_time_s)
    # Joints move as their encoders say, and stand where the motors do: zeros of joint encoders may be elsewhere.
    speed, acceleration = differentiate(moved, log.sample_time_s, cutoff)
    smooth = lowpass(angle, log.sample_time_s, cutoff)
    joints = [np.zeros((log.n_samples, robot.n_joints)) for _ in range(3)]
    for joint, axes in zip(joints, (smooth, speed, acceleration), strict=True):
        joint[:, robot.axis_joints] = axes
    return np.asarray(robot.inverse_dynamics(*joints)[:, robot.axis_joints])


def stiffnesses(robot: Robot) -> Array:
    """Return the stiffness of the gears (n_axes,) [Nm/rad]; infinite for rigid ones."""
    values = robot.parameters()
    names = [robot.axis_parameter(axis, "stiffness") for axis in robot.axis_numbers()]
    return np.array([np.inf if name is None else values[name] for name in names])
