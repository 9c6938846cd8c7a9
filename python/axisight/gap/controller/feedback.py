"""The controller of a robot file as algebra, in time and over frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.frf.errors import reference_to_input
from axisight.logs import Log
from axisight.logs.frozen import runs
from axisight.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

# Number of equal extreme samples in a row that count as a torque limit.
_FLAT_SAMPLES = 3


def before(x: Array) -> Array:
    """Return the sum over all earlier samples, without the present one (n, ...)."""
    return np.asarray(np.cumsum(x, axis=0) - x)


def as_taken(log: Log) -> tuple[Array, Array]:
    """Return motor positions [rad] and speeds [rad/s] as the controller computes them, (n, n_axes) each.

    Position zero is the controller's summed reference at the first sample. Without a run-up that is the first
    position, and the first speed is zero. Speeds are differences of neighbouring positions.
    """
    position = log.position_rad - log.position_rad[0]
    ahead, last = 0.0, position[:1]
    if log.run_up is not None:
        told = log.run_up.velocity_ref_rad_s.sum(axis=0) * log.sample_time_s
        ahead = told - (log.position_rad[0] - log.run_up.position_rad[0])
        last = log.run_up.position_rad[-1:] - log.position_rad[0]
    speed = np.diff(position, axis=0, prepend=last) / log.sample_time_s
    return position - ahead, np.asarray(speed)


def told_of(robot: Robot, log: Log, axis: int) -> tuple[Array, Array, Array]:
    """Return the references of an axis (from 0): speed, angle and rate of the reference, (n,) each, in rad and s.

    Angles count from the first sample. The speed is zero where the controller has position targets without
    speed references, or does not use these. Raises InputError for a log without references.
    """
    rates, targets, time = log.velocity_ref_rad_s, log.position_ref_rad, log.sample_time_s
    if rates is None and targets is None:
        raise InputError(f"log {log.name!r}: expected references, got none")
    if rates is not None and (targets is None or not robot.told_positions):
        speed = rates[:, axis]
        return speed, before(speed) * time, speed
    assert targets is not None  # the first check leaves one of both
    target = targets[:, axis] - targets[0, axis]
    moved = np.diff(target, prepend=target[:1]) / time
    fed = robot.velocity_feedforward and rates is not None
    return rates[:, axis] if fed and rates is not None else np.zeros(len(moved)), target, moved


def feedback(robot: Robot, speed: Array, angle: Array, axis: int | None = None) -> Array:
    """Return the torque [Nm] for errors of speed [rad/s] and angle [rad], (n, n_axes), or (n,) of ``axis`` from 0.

    Before any limit. The law is linear: the parts of references and of positions may be computed apart.
    """
    proportional, integral = gain_shares(robot, speed, angle, axis)
    return np.asarray(proportional + integral)


def gain_shares(
    robot: Robot, speed: Array, angle: Array, axis: int | None = None
) -> tuple[Array, Array]:
    """Return the torques of the proportional and of the integral gain for the errors, as in `feedback`.

    A controller of positions has the gains of position and of speed instead. A computed torque takes the
    inertia at the operating point; with ``axis``, without its coupling to other axes.
    """
    gains = {k: v if axis is None else v[axis] for k, v in robot.controller_gains.items()}
    kp, ki = gains["kp"], gains.get("ki", 0.0)
    if "kd" in gains:
        shares = np.asarray(kp * angle), np.asarray(gains["kd"] * speed)
        if not robot.computed_torque:
            return shares
        inertia = inertia_of_motors(robot)
        if axis is not None:
            return shares[0] * inertia[axis, axis], shares[1] * inertia[axis, axis]
        return shares[0] @ inertia, shares[1] @ inertia
    if "kv" not in gains:
        return np.asarray(kp * speed), np.asarray(ki * angle)
    error = speed + gains["kv"] * angle
    return np.asarray(kp * error), np.asarray(ki * before(error) * robot.sample_time_s)


def told_as_torque(robot: Robot, speed: Array, angle: Array) -> Array:
    """Return position errors as the torque (n, n_axes) [Nm] that the gains make of them.

    For a cascade without its integral, which would sum noise to a drift.
    """
    proportional, other = gain_shares(robot, speed, angle)
    return proportional if "kv" in robot.controller_gains else np.asarray(proportional + other)


def told_gain(robot: Robot, frequency_hz: Array) -> Array:
    """Return the gain of `told_as_torque` over frequency, of each motor on its own (n_axes, n_freq) [Nm/rad]."""
    gains, time = robot.controller_gains, robot.sample_time_s
    if "kv" in gains:
        rate = (1 - np.exp(-2j * np.pi * frequency_hz * time)) / time
        return np.asarray(np.abs(gains["kp"][:, None] * (rate + gains["kv"][:, None])))
    response = controller_response(robot, frequency_hz)
    return np.asarray(np.abs(np.einsum("fii->if", response)))


def inertia_of_motors(robot: Robot) -> Array:
    """Return the inertia at the motors of a rigid robot at its operating point (n_axes, n_axes) [kg m^2]."""
    at = np.zeros(robot.n_joints)
    at[robot.axis_joints] = robot.operating_point
    driven = np.ix_(robot.axis_joints, robot.axis_joints)
    felt = robot.inertia_matrix(at)[driven] * np.outer(robot.gear_ratio, robot.gear_ratio)
    return np.asarray(felt + np.diag(rotors(robot)))


def rotors(robot: Robot) -> Array:
    """Return the inertia of each motor (n_axes,) [kg m^2]."""
    values = robot.parameters()
    return np.array([values[f"{joint}.motor_inertia"] for joint in robot.axis_names])


def controller_response(robot: Robot, frequency_hz: Array) -> Complex:
    """Return the sampled controller from motor angle to torque (n_freq, n_axes, n_axes) [Nm/rad]."""
    gains, time = robot.controller_gains, robot.sample_time_s
    kp, ki = gains["kp"], gains.get("ki", 0.0)
    back = np.exp(-2j * np.pi * frequency_hz * time)[:, None]
    out = (1 - back) / time
    if "kd" in gains:
        out = gains["kd"] * out + kp
        moved = inertia_of_motors(robot) if robot.computed_torque else np.eye(robot.n_axes)
        return np.asarray(moved * out[:, None, :])
    # A cascade sums its error up to the previous sample.
    cascade = "kv" in gains
    summed = ki * time * back / (1 - back)
    out = (out + gains["kv"]) * (kp + summed) if cascade else kp * out + ki
    return np.asarray(out[:, :, None] * np.eye(robot.n_axes))


def loop_responses(robot: Robot, frequency_hz: Array) -> tuple[Complex, Complex]:
    """Return how the torque of the loop responds to errors of the sensors and to torques on the motors.

    With controller ``F`` and machine ``G``: ``F (I + G F)^-1`` [Nm/rad] and ``F (I + G F)^-1 G`` [1], each
    (n_freq, n_axes, n_axes). At zero frequency, where both are infinite, the lowest positive frequency is used.
    """
    f = np.maximum(frequency_hz, frequency_hz[frequency_hz > 0].min())
    machine = robot.zoh_response(f).values
    from_angle = reference_to_input(machine, controller_response(robot, f))
    return from_angle, from_angle @ machine


def periodic_response(
    robot: Robot, effect: str, axis: int, loops: tuple[Complex, Complex], frequency_hz: Array
) -> Complex:
    """Return the response of an axis' torque (n_freq,) to an effect that is periodic in the motor angle.

    The input is an error of the sensor [rad], a torque on the motor [Nm] or an error of the gear [rad, joint
    side]. ``axis`` from 0; ``loops``: from `loop_responses`. A gear error acts as a turn of the motor that the
    sensor does not see, and for which the rotor's inertia and friction take no torque.
    """
    from_angle, from_torque = loops
    acts = effect_info(effect).acts
    if acts == "sensor":
        return np.asarray(from_angle[:, axis, axis])
    if acts != "transmission":
        return np.asarray(from_torque[:, axis, axis])
    values = robot.parameters()
    s = 2j * np.pi * frequency_hz
    rotor = values[f"{robot.axis_names[axis]}.motor_inertia"] * s**2
    friction = values[f"{robot.axis_names[axis]}.viscous_friction"] * s
    # Commands are held, half a sample late on average; these torques are not. Near the resonance both terms
    # cancel, so that half a sample matters.
    at_once = from_torque[:, axis, axis] * np.exp(0.5 * s * robot.sample_time_s)
    gear = (rotor + friction) * at_once - from_angle[:, axis, axis]
    return np.asarray(gear / robot.gear_ratio[axis])


def free_of_limits(torque: Array, width: int) -> Mask:
    """Mark the samples (n,) that are more than ``width`` samples away from a flat top of the torque."""
    free = np.ones(len(torque), dtype=bool)
    for extreme in (torque.min(), torque.max()):
        for a, b in runs(torque == extreme):
            if b - a >= _FLAT_SAMPLES:
                free[max(0, a - width) : b + width] = False
    return free
