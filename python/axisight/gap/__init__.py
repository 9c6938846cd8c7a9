"""Diagnosis of the gap between a simulator and measured logs: where, which, how far."""

from axisight.gap.faults import Finding, RefusedInputError
from axisight.gap.gate import check_fit_inputs, check_inputs
from axisight.gap.pipeline import diagnose
from axisight.gap.result import (
    AxisVerdict,
    Candidate,
    Cause,
    Diagnosis,
    Gap,
    Interval,
    MotionErrors,
    Overlay,
    Pooled,
    Remainder,
    Where,
)
from axisight.gap.schema import verdict_schema
from axisight.gap.separate.waves import ExperimentLimits
from axisight.gap.settings import Settings

__all__ = [
    "AxisVerdict",
    "Candidate",
    "Cause",
    "Diagnosis",
    "ExperimentLimits",
    "Finding",
    "Gap",
    "Interval",
    "MotionErrors",
    "Overlay",
    "Pooled",
    "RefusedInputError",
    "Remainder",
    "Settings",
    "Where",
    "check_fit_inputs",
    "check_inputs",
    "diagnose",
    "verdict_schema",
]
