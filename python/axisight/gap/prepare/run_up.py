"""Runs simulations up from rest to logs that start in motion.

A log does not contain the deflections of gears, the sums of the controller and the side of lost motion at its
start. A simulation produces them when it is driven smoothly from rest into the motion. What differs from the
machine decays with the slowest mode of the loop. The comparison starts after that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.controller.feedback import before, feedback
from axisight.gap.controller.loop_decay import FORGOTTEN, slowest_decay_1_s
from axisight.gap.facts.compared_quantity import Compared
from axisight.gap.facts.faults import Finding
from axisight.gap.prepare.first_state import LEAST_SAMPLES, with_first_state
from axisight.gap.simulator.start_poses import start_of
from axisight.logs import Log, RunUp
from axisight.robot import Robot
from axisight.simulation import simulate

Array = NDArray[np.float64]

# Duration of the run-up [s], with at least `LEAST_SAMPLES`.
RUN_UP_S = 0.5
# Duration from which the first motion of a log is estimated [s].
_SEEN_S = 0.02
# Fewest samples from which the first motion is estimated, at the controller's rate.
_SEEN_SAMPLES = 8
# Fewest logged samples from which the first motion is estimated, for logs sampled slower than the controller.
_SEEN_STEPS = 4
LEFT = 0.5
"""Smallest share of a log that must be left."""
# Iterations for the start angle, which depends on the holding torque there. Each step leaves 0.1 % of the
# error.
_STEPS = 2


class NotRunUpError(InputError):
    """No run-up is possible to a log that starts in motion; the message says why."""


def run_up_to(
    robot: Robot, loops: Sequence[Robot], log: Log, *, compared: Compared = "torques", step: int = 1
) -> Log:
    """Return a log with a run-up, from where the simulation has forgotten its start.

    - ``loops``: the robot with every controller that it is simulated with. All of them have to forget their
      start.
    - ``compared``: the quantity from which the first state is estimated.
    - ``step``: the cut is a whole number of so many samples.

    The run-up contains the part that is cut off the log. Raises NotRunUpError if too little of the log is left,
    or if a loop or the arm does not settle.
    """
    signals = (log.led(name) for name in ("position_rad", "torque_nm", "velocity_ref_rad_s"))
    if not all(np.isfinite(signal).all() for signal in signals):
        raise NotRunUpError(f"{log.name}: signals that are not finite")
    seen = max(_SEEN_SAMPLES, round(_SEEN_S / log.sample_time_s), _SEEN_STEPS * step)
    position = _start_polynomial(log.position_rad, log.sample_time_s, seen, 2)[0]
    try:
        pose = start_of(robot, position)
        burn_s = _burn_in_s(log, min(slowest_decay_1_s(r, pose) for r in loops), step)
        references = _references(log, seen)
        start_rad = _start_rad(robot, log, position, references, burn_s)
        references = with_first_state(robot, log, references, start_rad, burn_s, compared)
        run_up = _run_up(robot, log, position, references, start_rad)
    except NotRunUpError:
        raise
    except InputError as error:
        raise NotRunUpError(f"{log.name}: no run-up from rest ({error})") from error
    return _cut_after(replace(log, run_up=run_up, start_rad=start_rad), burn_s)


def _start_polynomial(signal: Array, step_s: float, seen: int, order: int) -> Array:
    """Return the polynomial through the first ``seen`` samples of a signal, (order + 1, n_axes), constant first."""
    n = min(seen, len(signal))
    return np.polynomial.polynomial.polyfit(step_s * np.arange(n), signal[:n], order)


def _burn_in_s(log: Log, decay_1_s: float, step: int) -> float:
    """Return the time [s] after which a loop has forgotten its start, in whole steps of samples."""
    if not decay_1_s > 0:
        raise NotRunUpError(f"{log.name}: the loop does not settle where the log begins")
    seconds = -np.log(FORGOTTEN) / decay_1_s
    if seconds > (1 - LEFT) * log.duration_s or log.duration_s - seconds < 1.0:
        raise NotRunUpError(
            f"{log.name}: the loop takes {seconds:.3g} s to forget how it began, more than half of "
            f"{log.duration_s:.3g} s"
        )
    whole = step * log.sample_time_s
    return float(np.ceil(seconds / whole) * whole)


def _references(log: Log, seen: int) -> Array:
    """Return references (m, n_axes) [rad/s] from rest to just before the first of a log: cubic in time."""
    assert log.velocity_ref_rad_s is not None  # closed loop only
    time = log.sample_time_s
    m = max(round(RUN_UP_S / time), LEAST_SAMPLES)
    s = (np.arange(m) / m)[:, None]
    first, rate = _start_polynomial(log.velocity_ref_rad_s, time, seen, 1)
    return np.asarray(first * s**2 * (3 - 2 * s) - rate * m * time * s**2 * (1 - s))


def _start_rad(robot: Robot, log: Log, position: Array, references: Array, burn_s: float) -> Array:
    """Return the joint angles (n_axes,) [rad] from which the run-up ends at the controller's state in the log.

    ``position`` (n_axes,) [rad]: motor positions at the start of the log.
    """
    travel = references.sum(axis=0) * log.sample_time_s
    start = start_of(robot, position)
    for _ in range(_STEPS):
        held = robot.equilibrium(start.tolist())["motor_torque_nm"].values
        start = start_of(robot, position + _angle_error(robot, log, held, burn_s) - travel)
    return start


def _angle_error(robot: Robot, log: Log, held_nm: Array, burn_s: float) -> Array:
    """Return the lead of the controller's summed reference over the motors at the start of a log (n_axes,) [rad].

    It follows from the torque that the law does not explain: its constant beyond the holding torque or, in a
    cascade with an integral, its slope. Zero if the law has no such term. For targets it is the logged lead
    without its mean, which gravity causes.
    """
    reference, time = log.velocity_ref_rad_s, log.sample_time_s
    assert reference is not None  # closed loop only
    gains = robot.controller_gains
    if robot.told_positions:
        assert log.position_ref_rad is not None  # a controller of targets
        ahead = log.position_ref_rad - log.position_rad
        return np.asarray(ahead[0] - ahead.mean(axis=0))
    ki = np.asarray(gains.get("ki", np.zeros(log.n_axes)))
    position = log.position_rad - log.position_rad[0]
    speed = np.gradient(position, time, axis=0)
    law = feedback(robot, reference - speed, before(reference) * time - position)
    missed = log.torque_nm - law
    if "kv" not in gains:
        seen = round(burn_s / time)
        return _quotient(missed[:seen].mean(axis=0) - held_nm, ki)
    at = time * np.arange(log.n_samples)
    offset, slope = np.polynomial.polynomial.polyfit(at, missed, 1)
    kv, kp = np.asarray(gains["kv"]), np.asarray(gains["kp"])
    summed = _quotient(slope, ki * kv)
    return np.where(ki > 0, summed, _quotient(offset - held_nm, kp * kv))


def _quotient(x: Array, by: Array) -> Array:
    """Return a quotient; zero where the divisor is not positive."""
    return np.asarray(np.where(by > 0, x / np.where(by > 0, by, 1.0), 0.0))


def _run_up(robot: Robot, log: Log, position: Array, references: Array, start_rad: Array) -> RunUp:
    """Return the simulated run-up along references, shifted smoothly to a log's first position and torque."""
    run = simulate(robot, references, method="rk4", start_rad=start_rad)
    moved, torque = run["position_rad"].values, run["torque_cmd_nm"].values
    if len(moved) < len(references) or not np.isfinite(moved).all():
        raise NotRunUpError(f"{log.name}: the simulator is unstable where the log begins")
    made = RunUp(position_rad=moved, torque_nm=torque, velocity_ref_rad_s=references)
    next_position = 2 * moved[-1] - moved[-2]
    next_torque = log.torque_nm[:_SEEN_SAMPLES].mean(axis=0)
    return made.less(next_position - position, torque[-1] - next_torque)


def compared_after_start(loops: Sequence[Robot], log: Log) -> Log:
    """Return a log from rest that is compared only where the ``loops`` have forgotten an error of its start.

    The part before it is the run-up. Raises NotRunUpError if too little is left, or if a loop does not settle.
    """
    pose = loops[0].operating_point if log.start_rad is None else log.start_rad
    return _cut_after(log, _burn_in_s(log, min(slowest_decay_1_s(r, pose) for r in loops), 1))


def _cut_after(log: Log, burn_s: float) -> Log:
    """Return a log from ``burn_s`` [s] on; the part before it is added to the run-up."""
    rest = log.part(burn_s)
    n = log.lead + log.n_samples - rest.n_samples
    run_up = RunUp(
        position_rad=log.led("position_rad")[:n],
        torque_nm=log.led("torque_nm")[:n],
        velocity_ref_rad_s=log.led("velocity_ref_rad_s")[:n],
    )
    return replace(rest, run_up=run_up, start_rad=log.start_rad)


def begins_in_motion(log: Log, start_s: float) -> Finding:
    """Return the finding about a log with a run-up that is compared from ``start_s`` [s] on."""
    message = (
        "expected a start at rest, like the simulation, got a start in motion and no rest in the first half. The "
        "simulation is run up from rest to the measured position, speed and reference. It is compared from "
        f"{start_s:.4g} s, where the loop has forgotten all but {100 * FORGOTTEN:g} % of an error of that start"
    )
    return Finding("begins_in_motion", "flag", message, log.name, None, "position")
