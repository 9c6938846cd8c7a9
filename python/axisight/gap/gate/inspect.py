"""Runs all checks of the gate in order: first those on which later ones rest."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor

from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.controller.clock_drift import with_drift
from axisight.gap.controller.other_controllers import clock_drift
from axisight.gap.facts.faults import Finding, RefusedInputError, check_names, flagged, refused
from axisight.gap.gate.beyond_a_turn import check_turns
from axisight.gap.gate.by_controller.closed_loop import check_closed_loop
from axisight.gap.gate.by_controller.follows_target import check_follows_target
from axisight.gap.gate.by_controller.stopped_following import check_stopped_following
from axisight.gap.gate.by_dynamics.inverse_checks import check_inverse
from axisight.gap.gate.by_dynamics.turned_axes import check_turned_axes
from axisight.gap.gate.copies import check_copies
from axisight.gap.gate.log_only import check_log_alone
from axisight.gap.gate.machine import check_machine
from axisight.gap.gate.noise_level import check_noise
from axisight.gap.gate.silent_torques import set_aside, silent_axes, without_silent
from axisight.gap.gate.start import check_start
from axisight.logs import Log
from axisight.robot import Robot
from axisight.robot.fixed_base import refuse_floating


def pass_gate(
    robot: Robot, estimation: Sequence[Log], validation: Sequence[Log], taken: Collection[str] = ()
) -> tuple[Finding, ...]:
    """Return the findings about a simulator and its logs; raise RefusedInputError if one is a refusal.

    Arguments as in :func:`check_inputs`.
    """
    findings = check_inputs(robot, estimation, validation, despite=taken)
    if refused(findings):
        raise RefusedInputError(findings)
    return findings


def pass_gate_by_targets(
    robot: Robot, estimation: Sequence[Log], validation: Sequence[Log], taken: Collection[str] = ()
) -> tuple[Finding, ...]:
    """Return the findings about logs with commands instead of logged torque, at their own rate.

    Raises RefusedInputError if one is a refusal.
    """
    findings = check_by_targets(robot, estimation, validation, despite=taken)
    if refused(findings):
        raise RefusedInputError(findings)
    return findings


def check_by_targets(
    robot: Robot,
    estimation: Sequence[Log],
    validation: Sequence[Log],
    *,
    despite: Collection[str] = (),
) -> tuple[Finding, ...]:
    """Return all faults of logs with commands in place of torque that show without a fit.

    ``despite`` as in :func:`check_inputs`. Raises InputError for a name that is no fault, or for a fault that
    rules out any diagnosis, and RobotError for a floating base.
    """
    check_names(despite)
    refuse_floating(robot, "the check of logs")
    logs = [*estimation, *validation]
    found = [f for f in check_machine(robot, logs) if f.name != "sample_time_differs"]
    found += _of_each(check_log_alone, logs)
    found += check_copies(estimation, validation)
    found += [f for log in logs for f in check_follows_target(robot, log)]
    found += [f for log in logs for f in check_stopped_following(log)]
    found += [f for log in logs for f in check_turns(robot, log)]
    return tuple(flagged(found, despite))


def check_inputs(
    robot: Robot,
    estimation: Sequence[Log],
    validation: Sequence[Log],
    *,
    despite: Collection[str] = (),
) -> tuple[Finding, ...]:
    """Return all faults of a simulator and its logs that show without a fit.

    ``robot``: the simulator; ``estimation``, ``validation``: logs of its machine. The checks run in stages:

    - the robot file against all logs;
    - each log alone, and logs against each other;
    - logs against the simulator: by the controller's law in closed loop, else by inverse dynamics;
    - the start and the noise of the logs.

    Axes whose torque carries nothing are set aside: later stages do not look at them. Logs that the second stage
    refuses are left out of the later ones, so that all faults of a data set show in one run. Any other refusal ends
    the checks, since later stages rest on it. ``despite``: names of faults that are only flagged. Raises InputError
    for a name that is no fault, or for a fault that rules out any diagnosis, and RobotError for a floating base.
    """
    check_names(despite)
    refuse_floating(robot, "the check of logs")
    found = flagged(_machine(robot, estimation, validation), despite)
    if refused(found):
        return tuple(found)
    alone = _logs(robot, estimation, validation)
    others = _refused_logs(f for f in flagged(alone, despite) if f.name != "channel_constant")
    silent = silent_axes(robot, _but([*estimation, *validation], others))
    found += flagged(set_aside(alone, silent), despite)
    spoiled = _refused_logs(found)
    sound, held = (without_silent(_but(x, spoiled), silent) for x in (estimation, validation))
    for stage in (_against_simulator, _start_and_noise):
        later = flagged(stage(robot, sound, held), despite) if sound or held else []
        found += later
        if refused(later):
            break
    return tuple(found)


_Logs = Sequence[Log]


def _refused_logs(findings: Iterable[Finding]) -> set[str | None]:
    """Return the names of the logs with a refusal of their own."""
    return {f.log for f in findings if f.severity == "refuse"}


def _but(logs: _Logs, names: Collection[str | None]) -> list[Log]:
    return [log for log in logs if log.name not in names]


def _machine(robot: Robot, estimation: _Logs, validation: _Logs) -> list[Finding]:
    return check_machine(robot, [*estimation, *validation])


def _logs(_robot: Robot, estimation: _Logs, validation: _Logs) -> list[Finding]:
    logs = [*estimation, *validation]
    alone = [*_of_each(check_log_alone, logs), *_of_each(check_stopped_following, logs)]
    return [*alone, *check_copies(estimation, validation)]


def _against_simulator(robot: Robot, estimation: _Logs, validation: _Logs) -> list[Finding]:
    logs = [*estimation, *validation]
    closed = is_closed_loop(robot, logs)
    found = _closed_loop(robot, logs) if closed else check_inverse(robot, logs)
    turned = [] if closed and refused(found) else check_turned_axes(robot, logs)
    if turned:
        # By inverse dynamics, a turned axis may look like another mistake.
        found = [f for f in found if f.severity != "refuse"]
    return [*_references(robot, logs), *found, *turned]


def _start_and_noise(robot: Robot, estimation: _Logs, validation: _Logs) -> list[Finding]:
    logs = [*estimation, *validation]
    start = check_start(robot, logs) if is_closed_loop(robot, logs) else []
    return [*start, *check_noise(robot, logs)]


def check_fit_inputs(robot: Robot | None, logs: Sequence[Log]) -> tuple[Finding, ...]:
    """Return the faults of logs for a fit without a simulator of the machine.

    The checks are those of `check_inputs` that need no simulator: each log alone, copies among the logs, and
    the gears of a robot file if one is given. The sample time of logs may differ from the robot's, but not by
    a unit (ms or us).
    """
    found = [] if robot is None else check_machine(robot, logs)
    out = [f for f in found if f.name != "sample_time_differs"]
    out += _of_each(check_log_alone, logs)
    return (*out, *check_copies(logs, ()))


def _of_each(check: Callable[[Log], list[Finding]], logs: Sequence[Log]) -> list[Finding]:
    """Return the findings of a check for each log, in the order of the logs. The checks run in parallel."""
    with ThreadPoolExecutor() as pool:
        return [finding for found in pool.map(check, logs) for finding in found]


def _closed_loop(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return the findings of each log against the controller, with the drift between two clocks undone.

    Drifting references look like any other mistake.
    """

    def found(seen: Sequence[Log]) -> list[Finding]:
        return _of_each(lambda log: check_closed_loop(robot, log), seen)

    out = found(logs)
    clock = clock_drift(robot, logs) if out else 0.0
    return found([with_drift(log, clock) for log in logs]) if clock else out


def _references(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Flag references that are missing in some logs: then all logs are compared by inverse dynamics."""
    missing = [log for log in logs if log.velocity_ref_rad_s is None]
    if robot.controller_kind == "none" or not missing or len(missing) == len(logs):
        return []
    message = (
        "expected velocity references as in the other logs, got none. All logs are compared by inverse "
        "dynamics, without the controller. Add the references, or leave this log out"
    )
    return [
        Finding("reference_missing", "flag", message, log.name, None, "velocity_ref")
        for log in missing
    ]
