"""Faults of simulator and logs that a reader of a diagnosis has to know, each with a stable name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

from axisight.errors import CaseError, InputError, LogError

GateSeverity = Literal["refuse", "flag"]

MEANINGS: dict[str, str] = {
    "simulator_differs": "a model that does not reproduce the user's own simulator",
    "axes_differ": "another number of axes than the robot, or than the other logs",
    "sample_time_differs": "another sample time than the robot's",
    "rates_differ": "another sample rate than the other logs",
    "time_in_ms": "time in ms instead of s",
    "time_in_us": "time in us instead of s",
    "gear_ratio_inverted": "motor angle per joint angle instead of joint angle per motor angle",
    "axis_turned": "an axis that turns the other way in the simulator",
    "file_unreadable": "truncated, corrupt or of another format",
    "log_too_short": "no or too few samples",
    "not_finite": "NaN or infinities",
    "time_not_increasing": "time stamps that stand still or run back",
    "time_jitter": "uneven time stamps",
    "rows_missing": "rows missing, by gaps in the time stamps or jumps of the positions",
    "rows_repeated": "rows given twice",
    "rows_shuffled": "rows out of order",
    "samples_frozen": "a channel stood still while the machine moved",
    "position_spike": "single wrong samples of a position",
    "torque_spike": "single wrong samples of a torque",
    "position_jumps": "jumps of one position",
    "position_wrapped": "whole turns are cut off",
    "position_clipped": "a position is cut at its extreme",
    "channel_constant": "a channel that never changes",
    "torque_saturated": "a torque is cut at a limit",
    "quantized_position": "position steps coarser than the noise the robot file states",
    "quantized_torque": "a torque of few levels",
    "quantized_velocity": "a velocity of few levels",
    "quantized_velocity_ref": "a reference of few levels",
    "quantized_joint_position": "a secondary encoder of few levels",
    "position_noise_large": "noise of a position far above that of the robot file",
    "log_repeated": "two estimation logs, or two validation logs, of the same content",
    "validation_copies_estimation": "a validation log that shares rows with an estimation log",
    "reference_missing": "velocity references missing on some axes or logs",
    "velocity_inconsistent": "a measured velocity that is not the derivative of the position",
    "axes_swapped": "a channel of one axis in the column of another",
    "sign_flipped": "a channel with the other sign",
    "time_shifted": "channels shifted in time against one another",
    "axis_delayed": "one axis late against the others or its reference",
    "position_in_degrees": "position in degrees instead of rad",
    "position_in_revolutions": "position in revolutions instead of rad",
    "position_in_counts": "position in encoder counts instead of rad",
    "position_in_mrad": "position in mrad (mm) instead of rad (m)",
    "position_joint_side": "joint-side instead of motor-side position",
    "position_scaled": "position by an unknown factor off",
    "velocity_ref_in_deg_s": "reference in deg/s instead of rad/s",
    "velocity_ref_in_rpm": "reference in rpm instead of rad/s",
    "velocity_ref_in_rev_s": "reference in rev/s instead of rad/s",
    "velocity_ref_in_mrad_s": "reference in mrad/s (mm/s) instead of rad/s (m/s)",
    "velocity_ref_joint_side": "joint-side instead of motor-side reference",
    "velocity_ref_scaled": "reference by an unknown factor off",
    "torque_in_mnm": "torque in mNm instead of Nm",
    "torque_in_knm": "torque in kNm instead of Nm",
    "torque_joint_side": "joint-side instead of motor-side torque",
    "torque_scaled": "torque by an unknown factor off: A, V or per cent of the rated torque",
    "torque_constant_unknown": "a current whose torque constant nobody knows",
    "torque_off_control_law": "a torque that is not what the robot file's controller gives",
    "gravity_flipped": "gravity of the robot file with the other sign",
    "begins_in_motion": "a log of a loop that begins in motion",
    "position_offset": "positions count from another zero than the robot's",
    "gap_beyond_torque": "a simulator that is off by more than ten times the torque",
    "bristles_slowed": "bristles of the simulator that slip faster than a step of a fit",
    "effect_within_scatter": "an effect of the simulator that the machine has within the scatter of its type",
    "reversals_smeared": "what remains lies around reversals, which the low-pass smears",
    "refit_worse": "a re-fit of the simulator's own parameters that held-out logs contradict",
    "parameter_at_edge": "a parameter of the simulator that the re-fit took to the edge of its tolerance",
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
        """Return the finding as in ``axisight.verdict/1``."""
        return {
            "name": self.name,
            "severity": self.severity,
            "log": self.log,
            "axis": self.axis,
            "field": self.field,
            "message": self.message,
        }


class RefusedInputError(CaseError, LogError):
    """Simulator or logs cannot be what they claim; ``findings`` has every fault that was found."""

    def __init__(self, findings: tuple[Finding, ...]) -> None:
        self.findings = findings
        # A scale that nobody knows is often what another fault does: a position in deg scales torques.
        faults = sorted(
            (f for f in findings if f.severity == "refuse"),
            key=lambda f: f.name.endswith("_scaled"),
        )
        counts = Counter(f.name for f in faults[1:])
        names = ", ".join(name if n == 1 else f"{n} of {name}" for name, n in counts.items())
        more = (
            f" (and {len(faults) - 1} more: {names}; 'axisight check LOG --robot MODEL' lists all)"
            if names
            else ""
        )
        super().__init__(f"{faults[0]}{more}")


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
