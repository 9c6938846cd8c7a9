"""Deflection of gears, where a log has positions of motor and joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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


def deflection_at_start(log: Log, robot: Robot) -> Array:
    """Return the deflection of the gears at the first sample (n_axes,) [rad, joint side]; NaN where it does not show.

    It shows on axes with a joint encoder whose torque turns round: then the zero of the encoder is known.
    """
    out = np.full(robot.n_axes, np.nan)
    for i, swing in enumerate(swings(log, robot)):
        if swing is not None:
            out[i] = _between_encoders(log, robot)[0, i] - swing.middle_rad
    return out


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
    if log.joint_position_rad is None:
        return [None] * robot.n_axes
    apart = _between_encoders(log, robot)
    torque, stiffness = joint_torque(log, robot), stiffnesses(robot)
    return [_swing(apart[:, i], torque[:, i], stiffness[i]) for i in range(robot.n_axes)]


def _swing(apart: Array, torque: Array, stiffness: float) -> Swing | None:
    if not np.isfinite(apart).all():
        return None
    size = np.abs(torque)
    small, large = np.quantile(size, [0.5, 0.75])
    weak = _to_either_side(apart, torque, (size > small) & (size <= large))
    strong = _to_either_side(apart, torque, size > large)
    if weak is None or strong is None:
        return None
    # A line through both: what is left of it without torque is play.
    slope = (strong[0] - weak[0]) / (strong[1] - weak[1])
    play = min(max(weak[0] - slope * weak[1], 0.0), strong[0])
    return Swing(strong[0], strong[1] / stiffness, play, strong[2] - slope * strong[3])


def _to_either_side(
    apart: Array, torque: Array, chosen: NDArray[np.bool_]
) -> tuple[float, float, float, float] | None:
    """Return half the distance between the medians of deflection and torque one way and the other, and their middles.

    None if the torque acts one way only.
    """
    ways = [chosen & (torque > 0), chosen & (torque < 0)]
    if min(float(way.mean()) for way in ways) < EACH_WAY:
        return None
    bent, load = ([float(np.median(x[way])) for way in ways] for x in (apart, torque))
    far, middle = ([0.5 * (x[0] + sign * x[1]) for x in (bent, load)] for sign in (-1, 1))
    return far[0], far[1], middle[0], middle[1]


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
