"""Reconstructs references that were not logged, from the logged torque and the stated controller.

The controller's law connects references, positions and torques. So the reference follows sample by sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.prepare.log_start import begins
from axisight.gap.signals.lowpass_cutoff import rigid_below_hz
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate, white_noise
from axisight.statistics.recursion import recursive

Array = NDArray[np.float64]

# Largest noise of a reconstructed reference in the upper part of the band, relative to the noise of measured
# speeds; a reference should have none. More is left if the machine has another controller.
_NOISE_LEFT = 0.1
# Start of the upper part of the band, as a share of the Nyquist frequency.
_UPPER = 0.8
# Largest speed step at the start that counts as rest, as a share of the largest speed. It comes from a holding
# torque that differs a little from the simulator's.
_STEP = 0.01
# Largest relative difference between the sample times of a log and of the controller.
_SAME_CLOCK = 1e-3

SAYS = (
    "References were not logged: those are taken with which the stated controller commands the logged torque. "
    "By what the machine's controller differs from it, and which limit cut its torque, cannot show."
)


def with_references(robot: Robot, logs: Sequence[Log]) -> list[Log] | None:
    """Return logs with reconstructed references (n, n_axes) [rad/s]; None if they cannot be reconstructed.

    Conditions: the robot has elastic gears, since inverse dynamics predicts the torque of rigid ones. It has a
    controller with a positive ``kp``. No log has references. All logs start at rest and have the controller's
    sample time. If a reconstructed reference is as noisy as measured speed, the torque comes from another
    controller, and None is returned.
    """
    missing = all(log.velocity_ref_rad_s is None for log in logs)
    if not robot.told_speeds or not missing or rigid_below_hz(robot) == np.inf:
        return None
    if np.any(np.asarray(robot.controller_gains["kp"]) <= 0):
        return None
    if not all(
        _has_every_sample(log, robot) and begins(log, robot.position_noise_std) != "motion"
        for log in logs
    ):
        return None
    found = [reference_of(robot, log) for log in logs]
    std = robot.position_noise_std
    if any(_noisy(r, log, std) for r, log in zip(found, logs, strict=True)):
        return None
    return [replace(log, velocity_ref_rad_s=r) for r, log in zip(found, logs, strict=True)]


def reference_of(robot: Robot, log: Log) -> Array:
    """Return the velocity reference (n, n_axes) [rad/s] for which the controller commands a log's torque.

    `gain_shares`, solved for the reference. At the first sample the holding torque is either the logged one, or
    the simulator's with a step of the reference. An error of this choice decays with the integral of the loop's
    error.
    """
    gains, step = robot.controller_gains, log.sample_time_s
    kp, ki = np.asarray(gains["kp"]), np.asarray(gains.get("ki", np.zeros(log.n_axes)))
    position = log.position_rad - log.position_rad[0]
    speed = np.diff(position, axis=0, prepend=position[:1]) / step
    torque = log.torque_nm - _holding_nm(robot, log)
    if "kv" not in gains:
        return _solved(speed + (torque + ki * position) / kp, ki / kp * step)
    error = _solved(torque / kp, ki / kp * step)
    kv = np.asarray(gains["kv"])
    return _solved(error + speed + kv * position, kv * step)


def _holding_nm(robot: Robot, log: Log) -> Array:
    """Return the torque (n_axes,) [Nm] that holds the arm before a log starts.

    The first logged torque; the simulator's, if the difference would be a visible step of the reference.
    """
    run = simulate(robot, np.zeros((1, log.n_axes)), start_rad=log.start_rad)
    simulated = run["torque_cmd_nm"].values[0]
    speed = np.abs(np.diff(log.position_rad, axis=0)).max(axis=0) / log.sample_time_s
    first, slight = log.torque_nm[0], _STEP * robot.controller_gains["kp"] * speed
    return np.asarray(np.where(np.abs(first - simulated) < slight, first, simulated))


def _solved(given: Array, share: Array) -> Array:
    """Return x (n, n_axes) with ``x + share * (sum of all x before) = given``."""
    columns = [
        recursive([1.0, -1.0], [1.0, float(s) - 1.0], g)
        for s, g in zip(np.broadcast_to(share, given.shape[1:]), given.T, strict=True)
    ]
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _has_every_sample(log: Log, robot: Robot) -> bool:
    return abs(log.sample_time_s / robot.sample_time_s - 1) < _SAME_CLOCK


def _noisy(reference: Array, log: Log, noise_std: float) -> bool:
    """Whether a reference has the noise of measured speeds on any axis, or of the stated sensor's if that is larger."""
    noise = white_noise(0, 0, *log.position_rad.shape) * noise_std
    speeds = [np.diff(x, axis=0) / log.sample_time_s for x in (log.position_rad, noise)]
    theirs = np.max([_upper_rms(x) for x in speeds], axis=0)
    return bool(np.any(_upper_rms(reference[1:]) > _NOISE_LEFT * theirs))


def _upper_rms(x: Array) -> Array:
    """Return the rms (n_axes,) of the upper part of the band."""
    spectrum = np.abs(np.fft.rfft(x * np.hanning(len(x))[:, None], axis=0)) ** 2
    return np.asarray(np.sqrt(spectrum[int(_UPPER * len(spectrum)) :].mean(axis=0)))
