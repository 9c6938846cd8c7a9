"""Previews one log with a simulator: what a diagnosis would compare, and its findings before any fit."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.facts.faults import Finding, refused
from axisight.gap.gate import check_by_targets, check_inputs
from axisight.gap.intake.start_of_logs import from_rest
from axisight.gap.prepare.currents import in_torques
from axisight.gap.prepare.position_targets import with_commands
from axisight.gap.prepare.reconstructed_references import SAYS, with_references
from axisight.gap.views.targets import what_is_compared
from axisight.logs import Log
from axisight.robot import Robot


@dataclass(frozen=True)
class Beside:
    """The comparison as a sentence, empty if a finding refuses the log, and all findings."""

    compared: str
    findings: tuple[Finding, ...]


def look_beside(robot: Robot, log: Log) -> Beside:
    """Return what a diagnosis would compare and find in a log of a robot, without a fit.

    Raises InputError as `with_commands`, for a log without torque that cannot be compared with this robot.
    """
    read = in_torques(robot, [log], [])
    (log,) = read.estimation
    unknown = tuple(nominal.finding() for nominal in read.nominal)
    commanded = with_commands(robot, [log])
    if commanded is not None:
        alone = check_by_targets(commanded.robot, commanded.as_logged(), [])
        findings = (*unknown, *commanded.findings(), *alone)
        compared = what_is_compared(log.sample_rate_hz)
    else:
        begun = from_rest(robot, [log], [], [])
        (log,) = begun.estimation
        findings = (*unknown, *begun.findings, *check_inputs(robot, [log], []))
        compared = "" if refused(findings) else _torques(robot, log)
    return Beside("" if refused(findings) else compared, findings)


def _torques(robot: Robot, log: Log) -> str:
    if is_closed_loop(robot, [log]):
        return "Torques are compared in closed loop: under the logged references and the stated controller."
    if with_references(robot, [log]) is not None:
        return SAYS
    return (
        "Torques are compared by inverse dynamics: without a controller, along the logged motion."
    )
