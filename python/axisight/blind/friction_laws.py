"""Friction laws with memory, with dependence on the angle, or behind the gear."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, sin

from axisight.blind.laws import Axis, Law

# Share of the slip strain up to which bristles only bend (Dupont et al. 2002).
_ELASTIC = 0.6


@dataclass
class ElastoPlastic(Law):
    """Bristles of the motor that bend, and slip more as they near their largest strain."""

    dry_nm: float
    way_rad: float
    strain: float = 0.0
    motor: float | None = None

    def begin(self, step_s: float) -> None:
        """Begin without strain."""
        del step_s
        self.strain, self.motor = 0.0, None

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        moved = 0.0 if self.motor is None else at.motor - self.motor
        self.motor = at.motor
        towards = self.strain * copysign(1.0, moved)
        slips = min(max((towards - _ELASTIC) / (1.0 - _ELASTIC), 0.0), 1.0)
        strain = self.strain + moved / self.way_rad * (1.0 - slips)
        self.strain = min(max(strain, -1.0), 1.0)
        return -self.dry_nm * self.strain, 0.0


@dataclass
class UnevenFriction(Law):
    """Dry friction of the joint that varies as a wave over its angle; ``waves`` per radian."""

    dry_nm: float
    share: float
    waves: float
    phase: float
    corner_rad_s: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the joint."""
        size = self.dry_nm * (1.0 + self.share * sin(self.waves * at.joint + self.phase))
        return 0.0, -size * at.joint_speed / (abs(at.joint_speed) + self.corner_rad_s)


@dataclass
class ViscousByDirection(Law):
    """Viscous friction with a coefficient for each direction, beside the machine's own."""

    forward_nm_s_rad: float
    backward_nm_s_rad: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        forward = at.motor_speed > 0
        return -(self.forward_nm_s_rad if forward else self.backward_nm_s_rad) * at.motor_speed, 0.0


@dataclass
class BehindGear(Law):
    """A motor's friction law applied to the joint: it takes the state of a motor on a rigid gear."""

    law: Law

    def begin(self, step_s: float) -> None:
        """Start the wrapped law."""
        self.law.begin(step_s)

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the joint."""
        turns = 1.0 / at.gear_ratio
        friction, _ = self.law.torque(
            replace(at, motor=turns * at.joint, motor_speed=turns * at.joint_speed)
        )
        return 0.0, turns * friction
