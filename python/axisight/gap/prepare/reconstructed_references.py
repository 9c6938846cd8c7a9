"""References that were not logged: those with which the stated controller commands the logged torque.

Its law is algebra of references, positions and torques: what is missing is found sample by sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.prepare.log_start import begins
from axisight.gap.signals.lowpass_cutoff import rigid_below_hz
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate, white_noise

Array = NDArray[np.float64]

# Of the noise of measured speeds, in the upper part of the band: references have none of it. More is left
# where the machine's controller is not the stated one.
_NOISE_LEFT = 0.1
_UPPER = 0.8
# Of the largest speed: what would begin with less begins at rest, its weight not quite the simulator's.
_STEP = 0.01
# By how much a sample time may be off and still be that of the controller.
_SAME_CLOCK = 1e-3

SAYS = (
    "References were not logged: those are taken with which the stated controller commands the logged torque. "
    "By what the machine's controller differs from it, and which limit cut its torque, cannot show."
)


def with_references(robot: Robot, logs: Sequence[Log]) -> list[Log] | None:
    """Return logs with the references (n, n_axes) [rad/s] that they lack; None where none are to be had.

    Only for a robot of elastic gears with a controller, whose torque no inverse dynamics predicts, and
    where no log has references, and all begin at rest and have every sample of the controller. None, too,
    where they are as noisy as measured speeds: the torque is not that of this controller.
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
    """Return the velocity reference (n, n_axes) [rad/s] for which the controller commands the torque of a log.

    `gain_shares` solved for the reference. Either the first sample commands what holds the arm, or the
    reference begins with a step and the simulator's weight holds it: what that is off by is forgotten as
    the integral of the error is.
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
    """Return the torque (n_axes,) [Nm] that holds the arm before the log begins.

    The first one, or the simulator's where that would make the first one a step of the reference.
    """
    run = simulate(robot, np.zeros((1, log.n_axes)), start_rad=log.start_rad)
    simulated = run["torque_cmd_nm"].values[0]
    speed = np.abs(np.diff(log.position_rad, axis=0)).max(axis=0) / log.sample_time_s
    first, slight = log.torque_nm[0], _STEP * robot.controller_gains["kp"] * speed
    return np.asarray(np.where(np.abs(first - simulated) < slight, first, simulated))


def _solved(given: Array, share: Array) -> Array:
    """Return x (n, n_axes) with ``x + share * (sum of all x before) = given``."""
    columns = [
        scipy.signal.lfilter([1.0, -1.0], [1.0, float(s) - 1.0], g)
        for s, g in zip(np.broadcast_to(share, given.shape[1:]), given.T, strict=True)
    ]
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _has_every_sample(log: Log, robot: Robot) -> bool:
    return abs(log.sample_time_s / robot.sample_time_s - 1) < _SAME_CLOCK


def _noisy(reference: Array, log: Log, noise_std: float) -> bool:
    """Whether a reference has the noise of measured speeds on any axis, or of the stated sensor's if that is more."""
    noise = white_noise(0, 0, *log.position_rad.shape) * noise_std
    speeds = [np.diff(x, axis=0) / log.sample_time_s for x in (log.position_rad, noise)]
    theirs = np.max([_upper_rms(x) for x in speeds], axis=0)
    return bool(np.any(_upper_rms(reference[1:]) > _NOISE_LEFT * theirs))


def _upper_rms(x: Array) -> Array:
    """Return the rms (n_axes,) of what lies in the upper part of the band."""
    spectrum = np.abs(np.fft.rfft(x * np.hanning(len(x))[:, None], axis=0)) ** 2
    return np.asarray(np.sqrt(spectrum[int(_UPPER * len(spectrum)) :].mean(axis=0)))
