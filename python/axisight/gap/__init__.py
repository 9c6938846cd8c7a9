"""Diagnosis of the gap between a simulator and measured logs: where, which, how far."""

from axisight.gap.facts.faults import Finding, RefusedInputError
from axisight.gap.facts.result import (
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
from axisight.gap.facts.schema import verdict_schema
from axisight.gap.facts.settings import DEFAULT_TOLERANCES, Settings
from axisight.gap.gate import check_fit_inputs, check_inputs
from axisight.gap.pipeline import diagnose
from axisight.gap.separate.limits import ExperimentLimits

__all__ = [
    "DEFAULT_TOLERANCES",
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
