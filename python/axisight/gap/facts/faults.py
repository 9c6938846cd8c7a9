"""Faults of simulator and logs that a reader of a diagnosis has to know, each with a stable name."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

from axisight.errors import CaseError, InputError, LogError
from axisight.logs.mending import mending_line

GateSeverity = Literal["refuse", "flag"]

MEANINGS: dict[str, str] = {
    "simulator_differs": "the model does not reproduce the user's own simulator",
    "axes_differ": "a log has another number of axes than the robot, or than the other logs",
    "sample_time_differs": "a log has another sample time than the robot",
    "rates_differ": "a log has another sample rate than the other logs",
    "time_in_ms": "the time is in ms instead of s",
    "time_in_us": "the time is in us instead of s",
    "gear_ratio_inverted": "a gear ratio states motor angle per joint angle instead of joint angle per motor angle",
    "axis_turned": "an axis turns the other way in the simulator",
    "file_unreadable": "the file is truncated, corrupt or of another format",
    "log_too_short": "the log has no samples, or too few",
    "not_finite": "a signal has NaN or infinite values",
    "time_not_increasing": "time stamps stand still or run backwards",
    "time_jitter": "time stamps are uneven",
    "rows_missing": "rows are missing, as gaps in the time stamps or jumps of the positions show",
    "rows_repeated": "rows appear twice",
    "rows_shuffled": "rows are out of order",
    "samples_frozen": "a channel stood still while the machine moved",
    "position_spike": "a position has single wrong samples",
    "torque_spike": "a torque has single wrong samples",
    "position_jumps": "a position jumps",
    "position_wrapped": "whole turns are cut off a position",
    "position_clipped": "a position is cut at its extreme",
    "channel_constant": "a channel never changes",
    "channel_dead": "a torque follows no motion and is smaller than its noise",
    "torque_saturated": "a torque is cut at a limit",
    "quantized_position": "a position has steps coarser than the noise that the robot file states",
    "quantized_torque": "a torque has few distinct values",
    "quantized_velocity": "a velocity has few distinct values",
    "quantized_velocity_ref": "a velocity reference has few distinct values",
    "quantized_joint_position": "a position measured on the joint has few distinct values",
    "gear_gives_way": "encoders on motor and joint show a gear that deflects otherwise than the simulator's",
    "position_noise_large": "a position has far more noise than the robot file states",
    "log_repeated": "two estimation logs, or two validation logs, have the same content",
    "validation_copies_estimation": "a validation log shares rows with an estimation log",
    "reference_missing": "velocity references are missing on some axes or logs",
    "velocity_inconsistent": "a measured velocity is not the derivative of the position",
    "axes_swapped": "a column holds the channel of another axis",
    "sign_flipped": "a channel has the wrong sign",
    "time_shifted": "channels are shifted in time against one another",
    "stopped_following": "an axis stops following its target, as if its motor were off",
    "axis_delayed": "one axis is late against the others or its reference",
    "position_in_degrees": "a position is in degrees instead of rad",
    "position_in_revolutions": "a position is in revolutions instead of rad",
    "position_in_counts": "a position is in encoder counts instead of rad",
    "position_in_mrad": "a position is in mrad (mm) instead of rad (m)",
    "position_joint_side": "a position is that of the joint instead of the motor",
    "position_scaled": "a position is off by an unknown factor",
    "velocity_ref_in_deg_s": "a velocity reference is in deg/s instead of rad/s",
    "velocity_ref_in_rpm": "a velocity reference is in rpm instead of rad/s",
    "velocity_ref_in_rev_s": "a velocity reference is in rev/s instead of rad/s",
    "velocity_ref_in_mrad_s": "a velocity reference is in mrad/s (mm/s) instead of rad/s (m/s)",
    "velocity_ref_joint_side": "a velocity reference is that of the joint instead of the motor",
    "velocity_ref_scaled": "a velocity reference is off by an unknown factor",
    "torque_in_mnm": "a torque is in mNm instead of Nm",
    "torque_in_knm": "a torque is in kNm instead of Nm",
    "torque_joint_side": "a torque is that of the joint instead of the motor",
    "torque_scaled": "a torque is off by an unknown factor: A, V or per cent of the rated torque",
    "torque_constant_unknown": "nobody knows the torque constant of a current",
    "torque_off_control_law": "a torque is not what the controller of the robot file commands",
    "gravity_flipped": "gravity in the robot file has the wrong sign",
    "torque_without_gravity": "the torque was logged without the share that holds the arm against gravity",
    "range_passed": "positions or targets lie beyond the range of a joint that the model file states",
    "begins_elsewhere": "all logs begin away from where the simulation begins",
    "begins_in_motion": "a log for a closed-loop simulation begins in motion",
    "position_offset": "positions count from another zero than the robot's",
    "gap_beyond_torque": "the simulator is off by more than ten times the torque",
    "bristles_slowed": "friction bristles of the simulator relax faster than a step of the fit",
    "effect_within_scatter": "an effect of the simulator has another value on the machine, within the usual scatter",
    "reversals_smeared": "the remaining gap lies around reversals, which the low-pass smears",
    "refit_worse": "held-out logs contradict the re-fit of the simulator's own parameters",
    "parameter_at_edge": "the re-fit moved a parameter of the simulator to the edge of its tolerance",
}
"""Every name and its meaning. Names are part of the interface and never change."""


NEEDED = frozenset(
    {
        "axes_differ",
        "sample_time_differs",
        "rates_differ",
        "time_in_ms",
        "time_in_us",
        "file_unreadable",
        "log_too_short",
        "not_finite",
        "time_not_increasing",
        "time_jitter",
    }
)
"""Faults that ``despite`` cannot override: no diagnosis is possible with them."""


@dataclass(frozen=True)
class Finding:
    """One fault of a simulator or its logs, found by the gate or by the re-fit.

    | field | content |
    |---|---|
    | ``name`` | one of ``MEANINGS`` |
    | ``severity`` | ``"refuse"`` where the data cannot be what they claim, ``"flag"`` where a diagnosis makes sense |
    | ``log`` | name of the log, None for the robot file or all logs |
    | ``axis`` | from 1, None where it concerns all or none |
    | ``field`` | column, key or parameter |
    | ``message`` | what was expected, what came, and what to do |
    """

    name: str
    severity: GateSeverity
    message: str
    log: str | None = None
    axis: int | None = None
    field: str = ""

    def __str__(self) -> str:
        """One line for a person, the name first."""
        where = f"{self.log}: {self.field}" if self.log else self.field
        return f"{self.name}: {where}: {self.message}"

    def to_dict(self) -> dict[str, Any]:
        """Return the finding as in ``axisight.verdict/2``."""
        return {
            "name": self.name,
            "severity": self.severity,
            "log": self.log,
            "axis": self.axis,
            "field": self.field,
            "message": self.message,
        }


class RefusedInputError(CaseError, LogError):
    """Simulator or logs cannot be what they claim; ``findings`` has every fault that was found.

    The message has one line for each fault, the worst first, with the line that mends it below.
    """

    def __init__(self, findings: tuple[Finding, ...]) -> None:
        self.findings = findings
        faults = sorted((f for f in findings if f.severity == "refuse"), key=_mildness)
        same: dict[tuple[str, int | None, str], list[Finding]] = {}
        for fault in faults:
            same.setdefault((fault.name, fault.axis, fault.field), []).append(fault)
        super().__init__("\n".join(_told(members) for members in same.values()))


def _mildness(fault: Finding) -> int:
    """Return the place of a fault in a list, the worst first."""
    if fault.name in NEEDED:
        return 0
    # A scale that nobody knows is often what another fault does: a position in deg scales torques.
    if fault.name.endswith("_scaled"):
        return 3
    return 1 if fault.axis is None else 2


def _told(members: list[Finding]) -> str:
    """Return the lines about one fault, which may be in several logs."""
    fault = members[0]
    others = [f.log for f in members[1:] if f.log is not None]
    also = f" (also in {', '.join(others)})" if others else ""
    mend = mending_line(fault.name, fault.axis, fault.field)
    return f"{fault}{also}" + (f"\n  {mend}" if mend else "")


def flagged(findings: Iterable[Finding], names: Collection[str]) -> list[Finding]:
    """Return the findings with those of ``names`` flagged where they were refused."""
    return [
        replace(f, severity="flag", message=f"{f.message} (used all the same, as asked for)")
        if f.severity == "refuse" and f.name in names
        else f
        for f in findings
    ]


def check_names(names: Collection[str]) -> None:
    """Raise InputError for a name that is no fault, or one of `NEEDED`."""
    for name in names:
        if name not in MEANINGS or name in NEEDED:
            known = ", ".join(n for n in MEANINGS if n not in NEEDED)
            raise InputError(f"despite: expected names among {known}, got {name!r}")


def refused(findings: Iterable[Finding]) -> bool:
    """Whether any of the findings rules out a diagnosis."""
    return any(finding.severity == "refuse" for finding in findings)


def by_kind(findings: Iterable[Finding]) -> list[list[Finding]]:
    """Return findings of one name together, in the order of their first ones."""
    out: dict[str, list[Finding]] = {}
    for finding in findings:
        out.setdefault(finding.name, []).append(finding)
    return list(out.values())
