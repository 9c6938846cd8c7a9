"""Formulas of parts on a joint, for the engine on Pinocchio: balancers, hoses, masses on springs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.blind.formulas import Formula, Place

Array = NDArray[np.float64]


@dataclass
class SpringBalancer(Formula):
    """A spring between a point of the base and a point of the link, slack at its free length.

    Lengths are relative to that from the joint to the point of the base: ``crank`` to the point of the link,
    ``free`` length of the spring. ``force_nm``: stiffness times both levers. The torque is largest where the
    link stands across.
    """

    force_nm: float
    crank: float
    free: float
    angle_rad: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque on the joint."""
        angle = at.joint + self.angle_rad
        length = np.sqrt(1 + self.crank**2 + 2 * self.crank * np.cos(angle))
        pull = np.maximum(1 - self.free / length, 0.0)
        return 0.0, self.force_nm * pull * np.sin(angle)


@dataclass
class WoundHose(Formula):
    """A hose around the joint that stiffens as it winds up."""

    stiffness_nm_rad: float
    wound_rad: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque on the joint."""
        wound = self.stiffness_nm_rad * self.wound_rad
        return 0.0, -wound * np.sinh(at.joint / self.wound_rad)


@dataclass
class HungMass(Formula):
    """A mass on a spring and a damper on the joint; trapezoidal rule from the start of the step."""

    inertia_kg_m2: float
    frequency_hz: float
    damping: float
    state: tuple[Array, Array, Array] = field(default_factory=lambda: (np.zeros(1),) * 3)
    time_s: float = 0.0

    def begin(self, place: Place, step_s: float) -> None:
        """Start at rest."""
        del step_s
        self.state = place.joint, place.joint_speed, np.zeros_like(place.joint)
        self.time_s = place.time_s

    def _moved(self, at: Place) -> tuple[Array, Array, Array]:
        """Return angle, speed and acceleration of the mass."""
        angle, speed, acceleration = self.state
        half, omega = 0.5 * (at.time_s - self.time_s), 2 * np.pi * self.frequency_hz
        spring, damper = omega**2, 2 * self.damping * omega
        reached = angle + half * speed
        pulled = spring * (at.joint - reached) + damper * at.joint_speed
        then = (speed + half * (acceleration + pulled)) / (1 + half * damper + half**2 * spring)
        where = reached + half * then
        return where, then, spring * (at.joint - where) + damper * (at.joint_speed - then)

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque of the mass on the joint."""
        return 0.0, -self.inertia_kg_m2 * self._moved(at)[2]

    def moved(self, at: Place) -> None:
        """Keep the state of the mass."""
        self.state, self.time_s = self._moved(at), at.time_s
