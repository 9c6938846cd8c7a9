"""Logs of a loop that begin in motion: taken from where they stand, run up to, or without their references.

A simulation of the loop begins at rest. What a controller had summed up before a log is in no log.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from axisight.errors import InputError
from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.controller.speed_loop import with_integral
from axisight.gap.facts.faults import Finding, flagged
from axisight.gap.gate.log_only import check_log_alone
from axisight.gap.prepare.log_start import begins, run_up_is_better
from axisight.gap.prepare.run_up import NotRunUpError, begins_in_motion, run_up_to
from axisight.gap.prepare.used_part import REST_S, stands
from axisight.gap.signals.encoder_steps import encoder_steps
from axisight.gap.signals.noise import position_noise_std
from axisight.gap.views.closed_loop import TRACKING_SPEED
from axisight.logs import Log
from axisight.robot import Robot

# Share of a log that has to be left.
_LEFT = 0.5


@dataclass(frozen=True)
class Begun:
    """Logs for a diagnosis, and what is to be said of those that begin in motion."""

    estimation: list[Log]
    validation: list[Log]
    simulated: list[Log]
    findings: tuple[Finding, ...] = ()


def from_rest(
    robot: Robot,
    estimation: Sequence[Log],
    validation: Sequence[Log],
    simulated: Sequence[Log],
    despite: Collection[str] = (),
) -> Begun:
    """Return logs along which the loop can be simulated, each from where it begins.

    Those that begin in motion are cut where they first stand. One that never does is cut where a simulation
    that is run up to its first motion has forgotten how it began, what is before it in its run-up; where
    that is not to be had of one, all are without references. ``simulated``: of the user's own simulator, one
    for each log or none; they are cut alike. ``despite`` as in `Settings`. Unchanged where the loop is not
    simulated along the logs.
    """
    logs = [*estimation, *validation]
    given = Begun(list(estimation), list(validation), list(simulated))
    targets = all(not log.has_torque and log.position_ref_rad is not None for log in logs)
    if any(log.n_axes != robot.n_axes for log in logs):
        return given
    if not targets and not is_closed_loop(robot, logs):
        return given
    moving = _moving(robot, logs, despite, simulates=not targets)
    if not any(moving):
        return given
    starts = [first_rest_s(log) if m else 0.0 for log, m in zip(logs, moving, strict=True)]
    if targets and any(s is None for s in starts):
        # The commands along them are not known yet: they are run up to where these are made, or refused.
        return given
    try:
        parts = [_from_start(robot, log, s, despite) for log, s in zip(logs, starts, strict=True)]
    except NotRunUpError as error:
        bare = [replace(log, velocity_ref_rad_s=None) for log in logs]
        never = [log.name for log, s in zip(logs, starts, strict=True) if s is None]
        n = len(estimation)
        return Begun(bare[:n], bare[n:], list(simulated), (_without_references(never, error),))
    return _taken(given, parts)


def _moving(
    robot: Robot, logs: list[Log], despite: Collection[str], *, simulates: bool
) -> list[bool]:
    """Return which logs begin in motion; where positions leave it open, by what a simulation has of their torque.

    Where one does, others that leave it open do too: they were logged alike. At rest where it is open and
    none can be run up to them.
    """
    noise = np.maximum(position_noise_std(logs), robot.position_noise_std)
    noise = np.maximum(noise, encoder_steps(robot, logs) / np.sqrt(12.0))
    how = [begins(log, noise) for log in logs]
    moving = [one == "motion" for one in how]
    if not simulates or "open" not in how:
        return moving
    open_logs = [log if one == "open" else None for log, one in zip(logs, how, strict=True)]
    run_ups = [None if log is None else _run_up_of_open(robot, log, despite) for log in open_logs]
    better = [
        found is not None and run_up_is_better(robot, log, found)
        for log, found in zip(logs, run_ups, strict=True)
    ]
    if not any(moving) and not any(better):
        return moving
    return [m or found is not None for m, found in zip(moving, run_ups, strict=True)]


def _run_up_of_open(robot: Robot, log: Log, despite: Collection[str]) -> Log | None:
    try:
        return _run_up(robot, log, despite)
    except NotRunUpError:
        return None


def _from_start(robot: Robot, log: Log, start_s: float | None, despite: Collection[str]) -> Log:
    """Return a log from where it stands, at ``start_s``, or with a run-up where it never does.

    Raises NotRunUpError as `_run_up`.
    """
    if start_s is not None:
        return log.part(start_s) if start_s else log
    return _run_up(robot, log, despite)


def _run_up(robot: Robot, log: Log, despite: Collection[str]) -> Log:
    """Return a log with a run-up.

    Raises NotRunUpError, also for a log with a fault: a simulation would go through what is cut off.
    """
    for fault in flagged(check_log_alone(log), despite):
        if fault.severity == "refuse":
            raise NotRunUpError(f"{log.name}: {fault.name} in {fault.field}")
    kept = with_integral(robot).with_controller_speed(TRACKING_SPEED)
    return run_up_to(robot, (robot, kept), log)


def _taken(given: Begun, parts: Sequence[Log]) -> Begun:
    """Return the parts in the place of their logs, and what is to be said of them."""
    logs = [*given.estimation, *given.validation]
    sims = given.simulated
    if len(sims) == len(logs):
        pairs = zip(sims, logs, parts, strict=True)
        sims = [sim if part is log else sim.part(_first_s(log, part)) for sim, log, part in pairs]
    said = tuple(
        _from(part, _first_s(log, part))
        for log, part in zip(logs, parts, strict=True)
        if part is not log
    )
    n = len(given.estimation)
    return Begun(list(parts[:n]), list(parts[n:]), sims, said)


def _first_s(log: Log, part: Log) -> float:
    """Return where [s] in a log its last part begins."""
    return (log.n_samples - part.n_samples) * log.sample_time_s


def first_rest_s(log: Log) -> float | None:
    """Return where [s] all motors of a log first stand, and their references; None if too little is left."""
    n = max(4, round(REST_S / log.sample_time_s))
    still = stands(log)
    still[: n // 2] = False
    places = np.flatnonzero(still)
    if not len(places) or places[0] > (1 - _LEFT) * log.n_samples:
        return None
    start = float(places[0] * log.sample_time_s)
    try:
        log.part(start)
    except InputError:
        return None
    return start


def _from(log: Log, start_s: float) -> Finding:
    if log.run_up is not None:
        return begins_in_motion(log, start_s)
    message = (
        f"expected a start at rest, where a simulation of the loop begins, got one in motion: taken from "
        f"{start_s:.4g} s, where all axes first stand"
    )
    return Finding("begins_in_motion", "flag", message, log.name, None, "position")


def _without_references(names: Sequence[str], why: NotRunUpError) -> Finding:
    message = (
        f"expected starts at rest, where a simulation of the loop begins, got starts in motion, "
        f"no rest of {REST_S:g} s in the first half of {', '.join(names)}, and no beginning to simulate from "
        f"({why}): torques are predicted from the measured motion instead, without the references; log from "
        f"rest, log longer, or leave these logs out"
    )
    return Finding("begins_in_motion", "flag", message, names[0], None, "position")
