"""A remainder with the gap that it leaves on logs that took no part in its fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.remainder.model import Remainder
from axisight.remainder.terms import Term

Array = NDArray[np.float64]
OwnParameters = Literal["re-fitted", "stated"]


@summarized
@dataclass(frozen=True, eq=False, kw_only=True)
class ModelledRemainder:
    """A remainder judged on validation logs by inverse dynamics.

    ``gap_before``, ``gap_after``: relative torque error with the causes, without and with the remainder, rms over
    axes and logs [1]; the same by axis (n_axes,). ``moving_before``, ``moving_after``: of the samples in motion [1].
    ``own_parameters``: ``"re-fitted"``, or ``"stated"`` where the remainder belongs to the simulator with its stated
    own parameters.
    """

    model: Remainder
    gap_before: float
    gap_after: float
    before_per_axis: Array
    after_per_axis: Array
    moving_before: float
    moving_after: float
    own_parameters: OwnParameters = "re-fitted"

    def to_dict(self) -> dict[str, Any]:
        """Return what stands in the verdict."""
        return {
            "own_parameters": self.own_parameters,
            "gap_before": self.gap_before,
            "gap_after": self.gap_after,
            "before_per_axis": self.before_per_axis.tolist(),
            "after_per_axis": self.after_per_axis.tolist(),
            "moving_before": self.moving_before,
            "moving_after": self.moving_after,
            "limits_nm": self.model.limits_nm.tolist(),
            "terms": [_term(term) for term in self.model.terms],
        }

    def lines(self) -> list[str]:
        """Return a line for each term: axis, how it acts, on what, held-out gain, and the hint."""
        return [
            f"axis {t.axis}: {t.words}; removes {100 * t.gain:.0f} % on held-out logs"
            f"{'; ' if t.hint else ''}{t.hint}"
            for t in self.model.terms
        ]


def _term(term: Term) -> dict[str, Any]:
    plain = ("axis", "acts", "variable", "of_axis", "unit", "x_unit", "period", "corner_rad_s")
    arrays = ("x", "value", "standard_error")
    return (
        {name: getattr(term, name) for name in (*plain, "gain", "significance", "hint")}
        | {name: getattr(term, name).tolist() for name in arrays}
        | {"words": term.words}
    )
