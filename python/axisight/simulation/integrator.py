"""How the nonlinear plant is integrated between two samples of the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from axisight import _core
from axisight.arguments import one_of
from axisight.errors import InputError

Method = Literal["dopri5", "rk4", "rkn4", "radau5", "rodas4", "auto"]


@dataclass(frozen=True)
class Integrator:
    """Method, and what rules its steps.

    ``method``: ``"rk4"`` and ``"rkn4"`` (Nyström's method: the same order, faster) take
    ``substeps`` fixed sub-steps per sample. The others hold the local error of every
    state below ``tolerance`` times its size: ``"dopri5"`` (explicit, order 5),
    ``"radau5"`` and ``"rodas4"`` (L-stable, orders 5 and 4, exact Jacobian), and
    ``"auto"``, which goes from ``dopri5`` to ``radau5`` when the plant proves stiff.
    The linear model uses ``substeps`` with the first two only, for its ripple.

    Raises InputError for another method, a tolerance below 1e-14 or not below 1 where it
    counts, and less than one sub-step.
    """

    method: Method = "dopri5"
    tolerance: float = 1e-7
    substeps: int = 1

    def __post_init__(self) -> None:
        """Refuse what no simulation would take."""
        one_of("method", self.method, get_args(Method))
        if self.substeps < 1:
            raise InputError(f"substeps: expected at least 1, got {self.substeps}")
        _core.check_integrator(self)
