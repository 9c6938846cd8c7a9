"""Friction with memory, uneven friction and friction behind the gear, for the engine on Pinocchio."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from axisight.blind.formulas import Formula, Place

Array = NDArray[np.float64]

# Slip displacements of the elements, relative to their mean.
_SPREAD = np.array([0.25, 0.75, 1.25, 1.75])


@dataclass
class SlidingElements(Formula):
    """Dry friction of the motor as equal parallel elements, elastic up to their slips (Al-Bender 2005)."""

    dry_nm: float
    way_rad: float
    strain: Array = field(default_factory=lambda: np.zeros((1, 1)))
    motor: Array = field(default_factory=lambda: np.zeros(1))

    def begin(self, place: Place, step_s: float) -> None:
        """Begin without strain."""
        del step_s
        self.motor, self.strain = place.motor, np.zeros((len(_SPREAD), *place.motor.shape))

    def _strains(self, at: Place) -> Array:
        ways = _SPREAD.reshape(-1, *[1] * np.ndim(at.motor)) * self.way_rad
        return np.clip(self.strain + (at.motor - self.motor) / ways, -1.0, 1.0)

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        return -self.dry_nm * self._strains(at).mean(axis=0), 0.0

    def moved(self, at: Place) -> None:
        """Keep the strains."""
        self.strain, self.motor = self._strains(at), at.motor


@dataclass
class UnevenArctan(Formula):
    """Dry friction of the joint that depends on its angle; an arc tangent of speed smooths the sign."""

    dry_nm: float
    share: float
    waves: float
    phase: float
    corner_rad_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the joint."""
        size = self.dry_nm * (1.0 + self.share * np.sin(self.waves * at.joint + self.phase))
        return 0.0, -size * 2 / np.pi * np.arctan(at.joint_speed / self.corner_rad_s)


@dataclass
class RoundedViscousByDirection(Formula):
    """Half the difference of viscous friction between the directions; a hyperbola rounds the corner at rest."""

    half_difference_nm_s_rad: float
    corner_rad_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        size = np.hypot(at.motor_speed, self.corner_rad_s) - self.corner_rad_s
        return -self.half_difference_nm_s_rad * size, 0.0


@dataclass
class BehindGear(Formula):
    """A motor's friction formula applied to the joint: it takes angle and speed of the joint."""

    formula: Formula

    def begin(self, place: Place, step_s: float) -> None:
        """Start the wrapped formula."""
        self.formula.begin(_unbent(place), step_s)

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the joint."""
        return 0.0, self.formula.torque(_unbent(at))[0] / at.gear_ratio

    def moved(self, at: Place) -> None:
        """End a step of the wrapped formula."""
        self.formula.moved(_unbent(at))


def _unbent(at: Place) -> Place:
    """Return the state that a rigid gear would have."""
    turns, still = 1.0 / at.gear_ratio, np.zeros_like(at.motor)
    motor, speed = turns * at.joint, turns * at.joint_speed
    return replace(at, motor=motor, motor_speed=speed, deflection=still, deflection_rate=still)
