"""The gate before a diagnosis: simulator and logs are looked at before anything is fitted to them."""

from axisight.gap.faults import MEANINGS, InputFinding, RefusedInputError
from axisight.gap.gate.inspect import check_inputs, pass_gate

__all__ = ["MEANINGS", "InputFinding", "RefusedInputError", "check_inputs", "pass_gate"]
