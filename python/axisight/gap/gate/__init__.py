"""The gate before a diagnosis: checks simulator and logs before anything is fitted to them."""

from axisight.gap.facts.faults import MEANINGS, Finding, RefusedInputError
from axisight.gap.gate.inspect import (
    check_by_targets,
    check_fit_inputs,
    check_inputs,
    pass_gate,
    pass_gate_by_targets,
)
from axisight.gap.gate.silent_torques import silent_axes

__all__ = [
    "MEANINGS",
    "Finding",
    "RefusedInputError",
    "check_by_targets",
    "check_fit_inputs",
    "check_inputs",
    "pass_gate",
    "pass_gate_by_targets",
    "silent_axes",
]
