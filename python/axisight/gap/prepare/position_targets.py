"""Adds the controller's commands to logs of positions and targets without torque, at the controller's rate.

The command of a controller of targets follows from targets and measured positions. Logs are often sampled
slower than the controller, and hold each target until the next sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.controller.feedback import feedback, rotors, told_as_torque
from axisight.gap.facts.faults import Finding
from axisight.gap.prepare.run_up import NotRunUpError, begins_in_motion, run_up_to
from axisight.gap.prepare.used_part import NOISES
from axisight.gap.signals.noise import position_noise_std
from axisight.gap.simulator.start_poses import at_their_poses, start_of
from axisight.logs import Log
from axisight.robot import Robot
from axisight.robot.robot import TOLD_POSITIONS

Array = NDArray[np.float64]

# Largest relative difference between a log's sample time and a whole multiple of the controller's.
_CLOCK = 0.01
# Largest speed of a start at rest, as a share of the top speed.
_AT_REST = 0.02


@dataclass(frozen=True)
class Commanded:
    """Logs at the controller's rate, with its commands as their torque.

    - ``robot``: at rest at the start of the logs; its controller uses the references that the logs have.
    - ``step``: samples of the controller per logged sample.
    - ``short_of_inertia``: axes (from 1) where the simulator's integration step takes away more inertia than
      the motor has.
    - ``from_s``: first used time of each log [s]; not zero for a log that starts in motion, which has a run-up.
    """

    robot: Robot
    logs: tuple[Log, ...]
    step: int
    short_of_inertia: tuple[int, ...] = ()
    from_s: tuple[float, ...] = ()

    def as_logged(self) -> list[Log]:
        """Return the logs at their own rate."""
        return [_thinned(log, self.step) for log in self.logs]

    def of(self, logs: Sequence[Log]) -> list[Log]:
        """Return other logs, one for each and at the logged rate, with commands at the controller's rate."""
        told = [_commanded(self.robot, log, self.step) for log in logs]
        return [replace(log, run_up=own.run_up) for log, own in zip(told, self.logs, strict=True)]

    def taken(self, logs: Sequence[Log]) -> list[Log]:
        """Return other logs, one for each, cut at the same first times; unchanged if their number differs."""
        if len(logs) != len(self.from_s):
            return list(logs)
        pairs = zip(logs, self.from_s, strict=True)
        return [log.part(start_s) if start_s else log for log, start_s in pairs]

    def findings(self) -> tuple[Finding, ...]:
        """Return the findings about logs that start in motion."""
        pairs = zip(self.logs, self.from_s, strict=True)
        return tuple(begins_in_motion(log, start_s) for log, start_s in pairs if start_s)

    def along(self, logs: Sequence[Log]) -> Commanded:
        """Return these logs along the positions of other logs at the controller's rate.

        Of these, only the logged samples are used. The commands change with the positions.
        """
        told = []
        for log, other in zip(self.logs, logs, strict=True):
            position = self.fine(other.position_rad[:: self.step])
            change = position - log.position_rad
            torque, velocity = log.torque_nm + self.of_error(change), log.velocity_rad_s
            if velocity is not None:
                velocity = velocity + np.gradient(change, log.sample_time_s, axis=0)
            told.append(
                replace(log, position_rad=position, torque_nm=torque, velocity_rad_s=velocity)
            )
        return replace(self, logs=tuple(told))

    def along_targets(self, log: Log) -> Log:
        """Return a log of targets at the logged rate, from rest, with references at the controller's rate and start."""
        told = _commanded(self.robot, log, self.step)
        return replace(told, start_rad=start_of(self.robot, log.position_rad[0]))

    def fine(self, values: Array) -> Array:
        """Return a signal (n, n_axes) of the logs' rate at the controller's rate, by a cubic spline."""
        return between(values, self.step)

    def of_error(self, error_rad: Array) -> Array:
        """Return the torque (n, n_axes) [Nm] that the gains make of an error of positions, at the controller's rate."""
        return -feedback(self.robot, _speed(self.robot, error_rad), error_rad)

    def told_as(self, error_rad: Array) -> Array:
        """Return the torque (n, n_axes) [Nm] as which reports show an error of positions, at the controller's rate."""
        return -told_as_torque(self.robot, _speed(self.robot, error_rad), error_rad)


def with_commands(robot: Robot, logs: Sequence[Log]) -> Commanded | None:
    """Return logs without torque with the controller's commands along them; None if all logs have torque.

    Raises InputError in these cases:

    - only some logs have torque;
    - the robot has no controller of targets, or a log no targets;
    - a sample time is no multiple of the controller's;
    - a log starts in motion, and no run-up to it is possible.
    """
    if all(log.has_torque for log in logs):
        return None
    _check(robot, logs)
    time = robot.sample_time_s
    step = round(logs[0].sample_time_s / time)
    start = np.mean([log.position_rad[0] for log in logs], axis=0)
    # Rates can be computed from targets, but a controller without a logged rate may not use them.
    known = robot.computed_torque or all(x.velocity_ref_rad_s is not None for x in logs)
    known = known or (_is_cascade(robot) and step == 1)
    fed = robot.velocity_feedforward and known
    at_start = robot.with_operating_point(start * robot.gear_ratio)
    machine = _with_step_inertia(at_start).with_velocity_feedforward(fed)
    begun = at_their_poses(machine, logs)
    whole = [_commanded(machine, log, step) for log in begun]
    told = [_with_run_up(machine, fine, log, step) for fine, log in zip(whole, logs, strict=True)]
    from_s = [
        (a.n_samples - b.n_samples) * a.sample_time_s for a, b in zip(whole, told, strict=True)
    ]
    return Commanded(machine, tuple(told), step, tuple(short_of_inertia(robot)), tuple(from_s))


def _is_cascade(robot: Robot) -> bool:
    """Whether a controller of targets is a cascade, which uses reference rates only if its robot file says so."""
    return "kv" in robot.controller_gains


def _with_run_up(machine: Robot, told: Log, log: Log, step: int) -> Log:
    """Return a log with commands, with a run-up if ``log`` starts in motion.

    Raises InputError if no run-up is possible.
    """
    moving = _moving(log)
    if not moving.any():
        return told
    try:
        return run_up_to(machine, (machine,), told, compared="positions", step=step)
    except NotRunUpError as error:
        axis = int(np.flatnonzero(moving)[0])
        raise InputError(
            f"log {log.name!r}: expected a start at rest, or one to simulate from, got axis {axis + 1} in motion "
            f"({error}): cut it with --from, or log longer"
        ) from error


def _with_step_inertia(robot: Robot) -> Robot:
    """Return a robot with the motor inertia changed by the simulator's integration step; a machine unchanged."""
    if robot.stepped is None:
        return robot
    own, added = robot.parameters(), robot.stepped[1]
    names = [robot.axis_parameter(axis, "motor_inertia") for axis in robot.axis_numbers()]
    # Explicit damping takes inertia away, at most all that the motor has; `short_of_inertia` names such axes.
    changed = {
        name: max(own[name] + float(more), 0.0)
        for name, more in zip(names, added, strict=True)
        if name is not None
    }
    return robot.with_parameters(changed)


def short_of_inertia(robot: Robot) -> list[int]:
    """Return the axes (from 1) where a simulator's integration step takes away more inertia than the motor has."""
    if robot.stepped is None:
        return []
    own, out = robot.parameters(), []
    for axis, more in zip(robot.axis_numbers(), robot.stepped[1], strict=True):
        name = robot.axis_parameter(axis, "motor_inertia")
        if name is not None and own[name] + float(more) < 0:
            out.append(axis)
    return out


def _earlier(target: Array, samples: float) -> Array:
    """Return targets (n, n_axes) shifted earlier by a number of samples; the last one is held.

    If a target changes within a sample, the controller gets the mean over the sample.
    """
    whole = int(samples)
    part = samples - whole
    longer = np.vstack([target, np.repeat(target[-1:], whole + 1, axis=0)])
    n = len(target)
    return np.asarray((1 - part) * longer[whole : whole + n] + part * longer[whole + 1 :][:n])


def between(values: Array, step: int) -> Array:
    """Return a signal (n, n_axes) with ``step - 1`` more samples between any two, by a cubic spline."""
    if step == 1:
        return values
    n = len(values)
    return np.asarray(
        scipy.interpolate.make_interp_spline(np.arange(n), values, k=3)(
            np.arange((n - 1) * step + 1) / step
        )
    )


def _between_known(signal: Array | None, step: int) -> Array | None:
    """Return a measured signal at the controller's rate; None if an axis lacks it."""
    known = signal is not None and bool(np.isfinite(signal).all())
    return between(signal, step) if signal is not None and known else None


def _check(robot: Robot, logs: Sequence[Log]) -> None:
    """Raise InputError naming the reason if commands cannot be computed from the logs."""
    for log in logs:
        if log.has_torque:
            others = ", ".join(x.name for x in logs if not x.has_torque)
            raise InputError(f"torque: expected it in all logs or in none, got none in {others}")
    if not robot.told_positions:
        raise InputError(
            f"torque: expected logged torques, or a robot file whose controller is {' or '.join(TOLD_POSITIONS)}, so "
            f"that the command follows from targets and positions; got no torque and controller {robot.controller_kind}"
        )
    for log in logs:
        if log.position_ref_rad is None:
            raise InputError(
                f"position_ref: expected targets beside the positions of log {log.name!r}, got none"
            )
        factor = log.sample_time_s / robot.sample_time_s
        steps = robot.velocity_feedforward and _is_cascade(robot) and round(factor) > 1
        if steps and log.velocity_ref_rad_s is None:
            raise InputError(
                f"velocity_ref: expected the rates that the cascade is fed (velocity_feedforward) beside the "
                f"targets of log {log.name!r}, which are steps at the controller's {robot.sample_time_s:g} s; got none"
            )
        if round(factor) < 1 or abs(factor / round(factor) - 1) > _CLOCK:
            raise InputError(
                f"sample_time: expected a multiple of the controller's {robot.sample_time_s:g} s, got "
                f"{log.sample_time_s:g} s in log {log.name!r}"
            )


def _moving(log: Log) -> NDArray[np.bool_]:
    """Return whether an axis moves at the start of a log (n_axes,)."""
    speed = np.gradient(log.position_rad, log.sample_time_s, axis=0)
    noise = position_noise_std([log]) / log.sample_time_s
    allowed = _AT_REST * np.abs(speed).max(axis=0) + NOISES * noise
    return np.asarray(np.abs(speed[0]) > allowed)


def _speed(robot: Robot, angle: Array) -> Array:
    """Return the speed that a controller computes from angles (n, n_axes); zero at the first sample."""
    return np.asarray(np.diff(angle, axis=0, prepend=angle[:1]) / robot.sample_time_s)


def _commanded(robot: Robot, log: Log, step: int) -> Log:
    """Return a log at the controller's rate, with its command as the torque."""
    assert log.position_ref_rad is not None  # checked before
    position = between(log.position_rad, step)
    n, time = len(position), robot.sample_time_s
    # A target is held until the next one.
    target = np.repeat(log.position_ref_rad, step, axis=0)[:n]
    if robot.stepped is not None:
        target = _earlier(target, 0.5 * robot.stepped[0] / time)
    rate = np.diff(target, axis=0, append=target[-1:]) / time
    if robot.velocity_feedforward and log.velocity_ref_rad_s is not None:
        rate = np.repeat(log.velocity_ref_rad_s, step, axis=0)[:n]
        target = target[0] + (np.cumsum(rate, axis=0) - rate) * time
    fed = rate if robot.velocity_feedforward else 0.0
    torque = feedback(robot, fed - _speed(robot, position), target - position)
    if robot.computed_torque:
        torque = torque + _fed_dynamics(robot, position, rate)
    return replace(
        log,
        sample_time_s=time,
        time_s=np.asarray(time * np.arange(n), dtype=np.float64),
        position_rad=position,
        torque_nm=np.ascontiguousarray(torque),
        position_ref_rad=target,
        velocity_ref_rad_s=np.ascontiguousarray(rate),
        velocity_rad_s=_between_known(log.velocity_rad_s, step),
        joint_position_rad=_between_known(log.joint_position_rad, step),
        temperature_c=None,
        acceleration_m_s2={},
    )


def _fed_dynamics(robot: Robot, position: Array, rate: Array) -> Array:
    """Return the command (n, n_axes) of a computed torque without its feedback, relative to the first sample."""
    motors = [position, _speed(robot, position), np.zeros_like(position)]
    if robot.velocity_feedforward:
        motors[2] = np.diff(rate, axis=0, prepend=rate[:1]) / robot.sample_time_s
    joints = [np.zeros((len(position), robot.n_joints)) for _ in motors]
    for joint, motor in zip(joints, motors, strict=True):
        joint[:, robot.axis_joints] = motor * robot.gear_ratio
    forces = robot.inverse_dynamics(*joints)[:, robot.axis_joints]
    torque = forces * robot.gear_ratio + rotors(robot) * motors[2]
    return np.asarray(torque - torque[0])


def _thinned(log: Log, step: int) -> Log:
    """Return every ``step``-th sample of a log."""
    reference, target = log.velocity_ref_rad_s, log.position_ref_rad
    velocity, joint = log.velocity_rad_s, log.joint_position_rad
    return replace(
        log,
        sample_time_s=log.sample_time_s * step,
        time_s=log.time_s[::step],
        position_rad=log.position_rad[::step],
        torque_nm=log.torque_nm[::step],
        position_ref_rad=None if target is None else target[::step],
        velocity_ref_rad_s=None if reference is None else reference[::step],
        velocity_rad_s=None if velocity is None else velocity[::step],
        joint_position_rad=None if joint is None else joint[::step],
        acceleration_m_s2={n: x[::step] for n, x in log.acceleration_m_s2.items()},
        run_up=None,
    )
