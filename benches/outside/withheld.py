"""What is withheld from a simulator, and the place where it is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .arms import Arm
from .loop import Law


@dataclass(frozen=True)
class Place:
    """An axis (from 0) of an arm, with what its motor does in the nominal motion.

    ``torque_nm``, ``speed_rad_s``: rms about the mean; ``peak_nm``: largest torque about its value at
    rest, ``rest_nm``. ``travel_rad``: travel of the joint about ``middle_rad``. ``size`` multiplies what is drawn.
    """

    arm: Arm
    axis: int
    torque_nm: float
    peak_nm: float
    rest_nm: float
    speed_rad_s: float
    travel_rad: float
    middle_rad: float
    size: float
    rng: np.random.Generator

    @property
    def joint(self) -> int:
        """Index of the driven joint."""
        return self.arm.driven[self.axis]

    @property
    def ratio(self) -> float:
        """Gear ratio."""
        return float(self.arm.ratios[self.axis])

    @property
    def deflection_rad(self) -> float:
        """Rms deflection of the gear [rad]."""
        return self.torque_nm / self.ratio / self.arm.joints[self.joint].stiffness

    def amount(self, low: float, high: float) -> float:
        """Return a log-uniform number, times the size."""
        return self.size * float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def signed(self, low: float, high: float) -> float:
        """Return the same with either sign."""
        return self.amount(low, high) * float(self.rng.choice([-1, 1]))


@dataclass(frozen=True)
class Withheld:
    """One effect: its name, axis (from 1; two for a coupling; None for the arm), parameters and laws.

    Parameters with the name and meaning of Axisight's table of effects are compared; others say how
    this engine's own formula was set. ``simulator`` changes the robot file instead of the machine.
    """

    effect: str
    axis: int | None
    parameters: dict[str, float]
    laws: list[Law] = field(default_factory=list)
    axes: list[int] | None = None
    simulator: Callable[[Arm], Arm] | None = None

    def truth(self) -> dict[str, object]:
        """Return the entry of the truth file."""
        entry: dict[str, object] = {"effect": self.effect, "axis": self.axis}
        if self.axes is not None:
            entry["axes"] = self.axes
        return {**entry, "params": {k: float(v) for k, v in self.parameters.items()}}
