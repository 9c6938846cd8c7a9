"""Integration of the nonlinear plant between two samples of the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from axisight import _core
from axisight.arguments import one_of
from axisight.errors import InputError

Method = Literal["dopri5", "rk4", "rkn4", "radau5", "rodas4", "auto"]


@dataclass(frozen=True)
class Integrator:
    """Integration method with its step control.

    ``"rk4"`` and ``"rkn4"`` (Nyström's method: the same order, faster) take ``substeps`` fixed
    sub-steps per sample. The other methods keep the local error of every state below ``tolerance``
    times its size. They are ``"dopri5"`` (explicit, order 5), ``"radau5"`` and ``"rodas4"`` (L-stable,
    orders 5 and 4, exact Jacobian), and ``"auto"``, which changes from ``dopri5`` to ``radau5`` for a
    stiff plant. The linear model uses ``substeps`` with ``"rk4"`` and ``"rkn4"`` only, for its ripple.

    Raises InputError for another method, less than one sub-step, and, for methods that use it, a
    tolerance below 1e-14 or not below 1.
    """

    method: Method = "dopri5"
    tolerance: float = 1e-7
    substeps: int = 1

    def __post_init__(self) -> None:
        """Check all fields."""
        one_of("method", self.method, get_args(Method))
        if self.substeps < 1:
            raise InputError(f"substeps: expected at least 1, got {self.substeps}")
        _core.check_integrator(self)
