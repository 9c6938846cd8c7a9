"""Terms of the torque other than links: rotors, friction, offsets, springs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError

Array = NDArray[np.float64]
Side = Literal["motor", "joint"]
# The equations of a torque model: the six of a floating base alone, or with those of motors or joints.
ModelSide: TypeAlias = Literal["motor", "joint", "base"]
Sides: TypeAlias = Side | tuple[Side, ...] | None

# Kind of term, its signal in the core, its name on the motor side and on the joint side.
KINDS = (
    ("inertia", "acceleration", "motor_inertia", "joint_rotor_inertia"),
    ("viscous", "velocity", "viscous_friction", "joint_viscous_friction"),
    ("coulomb", "direction", "coulomb_friction", "joint_coulomb_friction"),
    ("offset", "constant", "torque_offset", "joint_torque_offset"),
)


@dataclass(frozen=True)
class DriveTerms:
    """Parameters of every driven axis other than those of its link.

    Each of the four kinds is ``None`` (absent), ``"motor"``, ``"joint"`` or both as a tuple.
    A motor-side term depends on the motor's speed or acceleration, and its torque acts on the motor.
    A joint-side term belongs to the joint in the same way. Both are equivalent for an axis with its
    own gear. They differ if motors are coupled (see :class:`MotorCoupling`): a motor that two joints
    turn has friction when either joint turns.

    inertia
        Rotor: ``motor_inertia`` [kg m^2], motor side, or ``joint_rotor_inertia``, joint side
        (J_m / r^2).
    viscous
        ``viscous_friction`` or ``joint_viscous_friction`` [Nm s/rad].
    coulomb
        ``coulomb_friction`` or ``joint_coulomb_friction`` [Nm], times the sign of the speed.
    offset
        ``torque_offset`` or ``joint_torque_offset`` [Nm]: amplifier offset, asymmetric friction.
    dead_band_rad_s
        Speed below which the sign of the speed counts as zero, on the term's own side.
    smoothing_rad_s
        Replaces the sign by ``tanh(speed / smoothing)``; zero is the sign itself.
    springs
        Whether stiffness and damping of every elastic joint are parameters too. Without them, the
        rows of elastic joints are the torques of their springs.

    Raises InputError naming the field.
    """

    inertia: Sides = None
    viscous: Sides = None
    coulomb: Sides = None
    offset: Sides = None
    dead_band_rad_s: float = 0.0
    smoothing_rad_s: float = 0.0
    springs: bool = False

    def __post_init__(self) -> None:
        """Check the choices."""
        for kind, *_ in KINDS:
            self.sides(kind)
        for field in ("dead_band_rad_s", "smoothing_rad_s"):
            value = getattr(self, field)
            if not (isinstance(value, (int, float)) and np.isfinite(value) and value >= 0):
                raise InputError(f"{field}: expected a number not below zero, got {value!r}")

    def sides(self, kind: str) -> tuple[Side, ...]:
        """Return the sides of a kind of term, motor side first."""
        given = getattr(self, kind)
        sides = () if given is None else (given,) if isinstance(given, str) else tuple(given)
        if any(side not in ("motor", "joint") for side in sides) or len(set(sides)) < len(sides):
            raise InputError(
                f'{kind}: expected None, "motor", "joint" or ("motor", "joint"), got {given!r}'
            )
        return tuple(side for side in ("motor", "joint") if side in sides)

    def settings(self, kind: str) -> tuple[float, float]:
        """Return dead band and smoothing of a kind of term, zero for kinds without them."""
        if kind == "coulomb":
            return float(self.dead_band_rad_s), float(self.smoothing_rad_s)
        return 0.0, 0.0


USUAL_TERMS = DriveTerms(inertia="motor", viscous="motor", coulomb="motor", offset="motor")
"""Rotor inertia, viscous and Coulomb friction and an offset, all motor side."""
