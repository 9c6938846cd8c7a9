"""What a regression says about its data, as data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from axisight.display.summary import summarized


class FindingKind(StrEnum):
    """What a finding is about."""

    RANK = "rank"
    """The data do not separate all base parameters; some were grouped further."""
    CONDITION = "condition"
    """The regression is badly conditioned: small errors of the data become large ones."""
    REVERSAL = "reversal"
    """An axis hardly ever reverses: its Coulomb friction rests on little or nothing."""
    LEFT_OUT = "left_out"
    """Samples around reversals were left out; serious if it was less than intervals need."""
    FEW_SAMPLES = "few_samples"
    """An axis has few samples for its parameters: its residual comes out too small."""
    BENDING = "bending"
    """Springs of the robot file give way to the motion: arm inertias come out too large."""
    MISFIT = "misfit"
    """A log is not explained, or far worse than another."""
    GEAR_SIGN = "gear_sign"
    """An axis by itself wants a negative inertia: gear ratio or torque have the wrong sign."""
    NEGATIVE_FRICTION = "negative_friction"
    """Friction that drives."""
    WEIGHTS = "weights"
    """Row weights did not settle."""
    FREEDOM = "freedom"
    """Standard errors rest on too few blocks or equations."""
    ELIMINATED = "eliminated"
    """Parameters were set to zero because the data do not show them."""


@summarized
@dataclass(frozen=True)
class IdentificationFinding:
    """One observation about a regression.

    kind
        See :class:`FindingKind`.
    message
        What was seen, with figures, and what to do about it.
    serious
        True if the estimate is not to be trusted without a look at it.
    names
        Parameters or rows concerned.
    """

    kind: FindingKind
    message: str
    serious: bool = True
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        """One line for a person."""
        return self.message
