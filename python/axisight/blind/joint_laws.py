"""Laws of parts on a joint that the simulator lacks: balancers, cables, masses on springs."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

from axisight.blind.laws import Axis, Law


@dataclass
class Balancer(Law):
    """A spring without free length between base and link: its torque is a sine of the joint's angle."""

    sine_nm: float
    cosine_nm: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque on the joint."""
        return 0.0, self.sine_nm * sin(at.joint) + self.cosine_nm * cos(at.joint)


@dataclass
class Cable(Law):
    """Cables that pull a joint back to their rest angle."""

    stiffness_nm_rad: float
    rest_rad: float = 0.0

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque on the joint."""
        return 0.0, -self.stiffness_nm_rad * (at.joint - self.rest_rad)


@dataclass
class Swing(Law):
    """A mass on a spring on the joint; trapezoidal rule in time."""

    inertia_kg_m2: float
    frequency_hz: float
    damping: float
    before: Axis | None = None
    angle: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0

    def begin(self, step_s: float) -> None:
        """Start at rest relative to the joint."""
        del step_s
        self.before = None

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque of the mass on the joint."""
        if self.before is None:
            self.angle, self.speed, self.acceleration = at.joint, at.joint_speed, 0.0
            self.before = at
        half = 0.5 * (at.time_s - self.before.time_s)
        omega = 2 * pi * self.frequency_hz
        spring, damper = omega**2, 2 * self.damping * omega
        reached = self.angle + half * self.speed
        pulled = spring * (at.joint - reached) + damper * at.joint_speed
        speed = self.speed + half * (self.acceleration + pulled)
        self.speed = speed / (1 + half * damper + half**2 * spring)
        self.angle = reached + half * self.speed
        self.acceleration = spring * (at.joint - self.angle) + damper * (
            at.joint_speed - self.speed
        )
        self.before = at
        return 0.0, -self.inertia_kg_m2 * self.acceleration
