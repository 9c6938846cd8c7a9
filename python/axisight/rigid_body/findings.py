"""Findings of a regression about its data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from axisight.display.summary import summarized


class FindingKind(StrEnum):
    """The subject of a finding."""

    RANK = "rank"
    """The data do not separate all base parameters; some were grouped further."""
    CONDITION = "condition"
    """The regression is badly conditioned: small errors of the data become large ones."""
    REVERSAL = "reversal"
    """An axis hardly ever reverses, so its Coulomb friction is poorly known or unknown."""
    LEFT_OUT = "left_out"
    """Samples around reversals were left out; serious if they were fewer than intervals need."""
    FEW_SAMPLES = "few_samples"
    """An axis has few samples for its parameters, so its residual is too small."""
    BENDING = "bending"
    """Springs of the robot file bend under the motion, so arm inertias are too large."""
    MISFIT = "misfit"
    """The parameters do not explain a log, or explain it far worse than another."""
    GEAR_SIGN = "gear_sign"
    """The fit of an axis alone has a negative inertia: gear ratio or torque have the wrong sign."""
    NEGATIVE_FRICTION = "negative_friction"
    """A friction coefficient is negative."""
    WEIGHTS = "weights"
    """Row weights did not converge."""
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
        The observation, with figures, and advice.
    serious
        Whether to check the finding before trusting the estimate.
    names
        Affected parameters or rows.
    """

    kind: FindingKind
    message: str
    serious: bool = True
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return the finding as one line."""
        return self.message
