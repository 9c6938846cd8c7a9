"""Diagnosis of the gap between a simulator and measured logs: where, which, how far."""

from axisight.gap.pipeline import diagnose
from axisight.gap.result import Candidate, Cause, Diagnosis, Gap, Interval, Overlay, Where
from axisight.gap.settings import Settings

__all__ = [
    "Candidate",
    "Cause",
    "Diagnosis",
    "Gap",
    "Interval",
    "Overlay",
    "Settings",
    "Where",
    "diagnose",
]
