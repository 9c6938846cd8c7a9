"""Turns currents with an unknown torque constant into torques, by a nominal constant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.controller.feedback import as_taken, feedback
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import Interval
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.gate.by_controller.control_law import ControlLaw
from axisight.gap.signals.lowpass_cutoff import highest_cutoff_hz
from axisight.gap.signals.motion import motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Cutoff [Hz] below which most arms are rigid.
_RIGID_HZ = 5.0
# Speed where the smoothed sign of dry friction turns, as a share of the largest speed.
_TURNS = 0.02
# Standard errors that the share of torque in a current must exceed. With fewer, the constant's error is over
# 1/3.
_SURE = 3.0
# Smallest share of a current that the controller's law must explain, and largest relative difference between
# the factors of its two parts. Otherwise the machine has another controller.
_EXPLAINED, _SAME = 0.9, 0.1
# Largest relative difference between the sample times of a log and of the controller.
_SAME_CLOCK = 1e-3
# Start of the upper part of the band, as a share of the Nyquist frequency.
_UPPER = 0.8


@dataclass(frozen=True)
class Nominal:
    """The constant [Nm/A] with which currents of an axis (from 1) were read, and its source."""

    axis: int
    nm_per_a: float
    source: str

    def finding(self, change: Interval | None = None) -> Finding:
        """Return the finding about an unknown constant.

        ``change``: relative change [1] of the nominal constant that the fit found; None before a fit.
        """
        said = f"expected a torque constant, got none: currents were read with {self.nm_per_a:.4g} Nm/A ({self.source})"
        if change is None:
            said += ". A diagnosis fits the constant; a factor of two from this value is no cause"
        else:
            value, low, high = (
                self.nm_per_a * (1 + x) for x in (change.value, change.low, change.high)
            )
            said += (
                f". In the fit the logs say {value:.4g} Nm/A (95 %: {low:.4g} to {high:.4g}). Values of causes rest "
                "on it. The difference is no cause. State the constant to be sure"
            )
        return Finding("torque_constant_unknown", "flag", said, None, self.axis, "torque")


@dataclass(frozen=True)
class Read:
    """Logs with torques instead of currents, and the nominal constants."""

    estimation: list[Log]
    validation: list[Log]
    nominal: tuple[Nominal, ...]


def in_torques(robot: Robot, estimation: Sequence[Log], validation: Sequence[Log]) -> Read:
    """Return logs with torques instead of currents whose torque constant is unknown.

    The nominal constant of an axis comes from the first of these sources that is available:

    - the controller's law, if it gives the current up to a factor;
    - the rated constant in the drive data;
    - the torque that the robot predicts beside friction, in the estimation logs.

    Raises InputError if the logs differ in their unknown axes, or if a current shows no torque of masses.
    """
    axes = unknown_axes(estimation)
    if any(unknown_axes([log]) != axes for log in [*estimation, *validation]):
        raise InputError('scale = "unknown": expected of the same axes in all logs, got others')
    found = tuple(_nominal(robot, estimation, axis - 1) for axis in axes)
    return Read(
        [_read(log, found) for log in estimation], [_read(log, found) for log in validation], found
    )


def unknown_axes(logs: Sequence[Log]) -> list[int]:
    """Return the axes (from 1) with an unknown torque constant."""
    return sorted(
        {i for log in logs for i, x in enumerate(log.nominal_nm_a, start=1) if x is not None}
    )


def _read(log: Log, nominal: Sequence[Nominal]) -> Log:
    factor, stated = np.ones(log.n_axes), list(log.nominal_nm_a)
    for one in nominal:
        read_by = stated[one.axis - 1]
        assert read_by is not None  # only unknown axes have a nominal constant
        factor[one.axis - 1] = one.nm_per_a / (read_by if np.isfinite(read_by) else 1.0)
        stated[one.axis - 1] = one.nm_per_a
    if not nominal:
        return log
    return replace(log, torque_nm=log.torque_nm * factor, nominal_nm_a=tuple(stated))


def _nominal(robot: Robot, logs: Sequence[Log], axis: int) -> Nominal:
    """Return the nominal constant of an axis (from 0)."""
    rated = logs[0].nominal_nm_a[axis]
    assert rated is not None
    unit = rated if np.isfinite(rated) else 1.0
    commanded = _by_the_law(robot, logs, axis)
    if commanded is not None:
        return Nominal(axis + 1, unit * commanded, "that of the controller's commands")
    if np.isfinite(rated):
        return Nominal(axis + 1, rated, "rated, of the drive data")
    predicted = _by_the_robot(robot, logs, axis)
    return Nominal(axis + 1, predicted, "torque that the robot predicts over current")


def _by_the_law(robot: Robot, logs: Sequence[Log], axis: int) -> float | None:
    """Return the factor that makes the logged torque the controller's command; None if no factor does."""
    if not robot.told_speeds:
        return None
    if not is_closed_loop(robot, logs):
        return _by_the_noise(robot, logs, axis)
    fits = [ControlLaw(robot, log).fit(axis, axis, axis) for log in logs]
    factors = np.array([[fit.reference, fit.position] for fit in fits])
    if min(fit.explained for fit in fits) < _EXPLAINED or not np.isfinite(factors).any():
        return None
    middle = float(np.nanmedian(factors))
    if not middle > 0 or np.nanmax(np.abs(factors / middle - 1)) > _SAME:
        return None
    return 1 / middle


def _by_the_noise(robot: Robot, logs: Sequence[Log], axis: int) -> float | None:
    """Return this factor for logs without references, from the controller's response to position noise.

    Only the upper part of the band is used. It holds no reference motion, and none can be reconstructed from a
    torque with an error of a few per cent.
    """
    if any(abs(log.sample_time_s / robot.sample_time_s - 1) > _SAME_CLOCK for log in logs):
        return None
    both = power = logged = 0.0
    for log in logs:
        position, speed = (x[:, axis] for x in as_taken(log))
        share = _upper(feedback(robot, -speed, -position, axis))
        torque = _upper(log.torque_nm[:, axis])
        both += float(np.vdot(share, torque).real)
        power += float(np.vdot(share, share).real)
        logged += float(np.vdot(torque, torque).real)
    return power / both if both > 0 and both**2 > _EXPLAINED * power * logged else None


def _upper(x: Array) -> NDArray[np.complex128]:
    """Return the spectrum of a signal (n,) in the upper part of the band."""
    spectrum = np.fft.rfft(x * np.hanning(len(x)))
    return np.asarray(spectrum[int(_UPPER * len(spectrum)) :])


def _by_the_robot(robot: Robot, logs: Sequence[Log], axis: int) -> float:
    """Return the constant with which the logs have the torque that the robot predicts.

    The current is regressed on this torque, beside friction and an offset, which are most of the current of
    some motors. The constant is positive: the gate has to see a current of the wrong sign. Raises InputError if
    the current is friction alone within its error.
    """
    cutoff = min(_RIGID_HZ, highest_cutoff_hz(logs[0].sample_time_s))
    motions = [motion(log, cutoff) for log in logs]
    torque = np.concatenate([predicted_torque(robot, AS_GIVEN, at)[:, axis] for at in motions])
    current = np.concatenate([at[3][:, axis] for at in motions])
    speed = np.concatenate([at[1][:, axis] for at in motions])
    turns = max(_TURNS * float(np.abs(speed).max()), 1e-300)
    friction, _ = np.linalg.qr(
        np.column_stack([np.tanh(speed / turns), speed, np.ones_like(speed)])
    )
    torque, current = (x - friction @ (friction.T @ x) for x in (torque, current))
    size, share = float(torque @ torque), float(torque @ current)
    # Below the cutoff, neighbouring samples are not independent.
    independent = 2 * cutoff * sum(log.duration_s for log in logs)
    left = float(current @ current) - share**2 / max(size, 1e-300)
    if not share**2 > _SURE**2 * max(left, 0.0) * size / independent:
        raise InputError(
            f"axis {axis + 1}: torque: expected a current that follows from the motion of masses, got one that is "
            f"friction at most: its torque constant cannot be found; state it as scale in the column map"
        )
    return size / abs(share)
