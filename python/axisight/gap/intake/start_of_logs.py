"""Handles closed-loop logs that start in motion: cuts them, adds a run-up, or drops their references.

A simulation of the loop starts at rest, and no log contains the sums that a controller had before it.
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
from axisight.gap.prepare.log_start import begins, run_up_is_better, torques_are_from_rest
from axisight.gap.prepare.run_up import LEFT, NotRunUpError, begins_in_motion, run_up_to
from axisight.gap.prepare.used_part import REST_S, stands
from axisight.gap.signals.encoder_steps import encoder_steps
from axisight.gap.signals.noise import position_noise_std
from axisight.gap.views.closed_loop import TRACKING_SPEED
from axisight.logs import Log
from axisight.robot import Robot


@dataclass(frozen=True)
class Begun:
    """Logs for a diagnosis, and the findings about logs that start in motion."""

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
    """Return logs along which the loop can be simulated, each from a possible start.

    A log that starts in motion is cut where it first stands. A log that never stands gets a run-up, and is cut
    where the simulation has forgotten its start. If one log allows no run-up, all logs lose their references.
    Logs stay unchanged if the loop is not simulated along them.

    ``simulated``: logs of the user's own simulator, one for each log or none; they are cut alike. ``despite``
    as in `Settings`.
    """
    logs = [*estimation, *validation]
    given = Begun(list(estimation), list(validation), list(simulated))
    targets = all(not log.has_torque and log.position_ref_rad is not None for log in logs)
    if any(log.n_axes != robot.n_axes for log in logs):
        return given
    if not targets and not is_closed_loop(robot, logs):
        return given
    run_ups = _RunUps(robot, despite)
    moving = _moving(run_ups, logs, simulates=not targets)
    if not any(moving):
        return given
    starts = [first_rest_s(log) if m else 0.0 for log, m in zip(logs, moving, strict=True)]
    if targets and any(s is None for s in starts):
        # Their commands are not computed yet; with_commands adds run-ups later, or refuses the logs.
        return given
    parts: list[Log] = []
    for log, start_s in zip(logs, starts, strict=True):
        part = run_ups.from_start(log, start_s)
        if isinstance(part, NotRunUpError):
            bare = [replace(log, velocity_ref_rad_s=None) for log in logs]
            never = [log.name for log, s in zip(logs, starts, strict=True) if s is None]
            n = len(estimation)
            findings = (_without_references(never, part),)
            return Begun(bare[:n], bare[n:], list(simulated), findings)
        parts.append(part)
    return _replaced(given, parts)


def loops_of(robot: Robot) -> tuple[Robot, Robot]:
    """Return the robot with its own controller, and with the one that keeps a simulation on a log."""
    return robot, with_integral(robot).with_controller_speed(TRACKING_SPEED)


def _moving(run_ups: _RunUps, logs: list[Log], *, simulates: bool) -> list[bool]:
    """Return whether each log starts in motion; where positions leave that open, torques decide.

    All logs were logged in one way: first torques that are from rest in all of them decide before positions do, since
    a soft gear may move soon. Otherwise, if one log starts in motion, the open ones do too. An open log counts as at
    rest if no run-up to it is possible.
    """
    robot = run_ups.robot
    noise = np.maximum(position_noise_std(logs), robot.position_noise_std)
    noise = np.maximum(noise, encoder_steps(robot, logs) / np.sqrt(12.0))
    how = [begins(log, noise) for log in logs]
    doubtful = [log for log, one in zip(logs, how, strict=True) if one != "rest"]
    if simulates and doubtful and run_ups.rest(doubtful):
        return [False] * len(logs)
    left_open = [log for log, one in zip(logs, how, strict=True) if one == "open"]
    moving = "motion" in how
    if simulates and left_open:
        moving = moving or any(run_ups.better_than_rest(log) for log in left_open)
    return [
        one == "motion"
        or (one == "open" and simulates and moving and isinstance(run_ups.to(log), Log))
        for log, one in zip(logs, how, strict=True)
    ]


class _RunUps:
    """Run-ups to the logs of one simulator, each computed once."""

    def __init__(self, robot: Robot, despite: Collection[str]) -> None:
        self.robot, self.despite = robot, despite
        self._made: dict[Log, Log | NotRunUpError] = {}

    def to(self, log: Log) -> Log | NotRunUpError:
        """Return a log with a run-up, or the error that rules it out."""
        if log not in self._made:
            try:
                self._made[log] = self._run_up(log)
            except NotRunUpError as error:
                self._made[log] = error
        return self._made[log]

    def _run_up(self, log: Log) -> Log:
        """Return a log with a run-up.

        Raises NotRunUpError, also for a log with a fault, since the simulation runs through the part that is
        cut off.
        """
        for fault in flagged(check_log_alone(log), self.despite):
            if fault.severity == "refuse":
                raise NotRunUpError(f"{log.name}: {fault.name} in {fault.field}")
        return run_up_to(self.robot, loops_of(self.robot), log)

    def rest(self, logs: Sequence[Log]) -> bool:
        """Whether the first torques of all logs are from rest; False where they cannot be simulated."""
        try:
            return torques_are_from_rest(self.robot, logs)
        except InputError:
            return False

    def better_than_rest(self, log: Log) -> bool:
        """Whether a simulation with a run-up fits a log better than one from rest.

        False if no simulation along the log is possible; the gate reports its fault.
        """
        if self.rest([log]):
            return False
        run_up = self.to(log)
        return isinstance(run_up, Log) and run_up_is_better(self.robot, log, run_up)

    def from_start(self, log: Log, start_s: float | None) -> Log | NotRunUpError:
        """Return a log cut at ``start_s`` [s], where it first stands.

        If it never stands (None), it gets a run-up, or the error is returned.
        """
        if start_s is not None:
            return log.part(start_s) if start_s else log
        return self.to(log)


def _replaced(given: Begun, parts: Sequence[Log]) -> Begun:
    """Return the cut logs instead of the given ones, and the findings about them."""
    logs = [*given.estimation, *given.validation]
    sims = given.simulated
    if len(sims) == len(logs):
        pairs = zip(sims, logs, parts, strict=True)
        sims = [sim if part is log else sim.part(_first_s(log, part)) for sim, log, part in pairs]
    said = tuple(
        _starts_in_motion(part, _first_s(log, part))
        for log, part in zip(logs, parts, strict=True)
        if part is not log
    )
    n = len(given.estimation)
    return Begun(list(parts[:n]), list(parts[n:]), sims, said)


def _first_s(log: Log, part: Log) -> float:
    """Return the time [s] in a log where its last part starts."""
    return (log.n_samples - part.n_samples) * log.sample_time_s


def first_rest_s(log: Log) -> float | None:
    """Return the time [s] where all motors and references of a log first stand; None if too little is left after it."""
    n = max(4, round(REST_S / log.sample_time_s))
    still = stands(log)
    still[: n // 2] = False
    places = np.flatnonzero(still)
    if not len(places) or places[0] > (1 - LEFT) * log.n_samples:
        return None
    start = float(places[0] * log.sample_time_s)
    try:
        log.part(start)
    except InputError:
        return None
    return start


def _starts_in_motion(log: Log, start_s: float) -> Finding:
    if log.run_up is not None:
        return begins_in_motion(log, start_s)
    message = (
        f"expected a start at rest, like the simulation, got a start in motion. The log is used from {start_s:.4g} s, "
        "where all axes first stand still"
    )
    return Finding("begins_in_motion", "flag", message, log.name, None, "position")


def _without_references(names: Sequence[str], why: NotRunUpError) -> Finding:
    message = (
        f"expected starts at rest, like the simulation, got starts in motion. The first half of {', '.join(names)} "
        f"has no rest of {REST_S:g} s, and no start can be estimated ({why}). All logs are compared by inverse "
        "dynamics, without the references. Log from rest, log longer, or leave these logs out"
    )
    return Finding("begins_in_motion", "flag", message, names[0], None, "position")
