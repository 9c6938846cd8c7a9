"""Diagnosis of the gap between a simulator and measured logs: where, which, how far."""

from axisight.gap.faults import InputFinding, RefusedInputError
from axisight.gap.gate import check_inputs
from axisight.gap.pipeline import diagnose
from axisight.gap.result import Candidate, Cause, Diagnosis, Gap, Interval, Overlay, Where
from axisight.gap.settings import Settings

__all__ = [
    "Candidate",
    "Cause",
    "Diagnosis",
    "Gap",
    "InputFinding",
    "Interval",
    "Overlay",
    "RefusedInputError",
    "Settings",
    "Where",
    "check_inputs",
    "diagnose",
]
