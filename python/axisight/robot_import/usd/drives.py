"""Drives of USD joints: numbers of the joint, gains and force limit of its drive."""

from __future__ import annotations

import math
from typing import Any

from axisight.errors import RobotError
from axisight.robot_import.bodies import Drive
from axisight.robot_import.usd.attributes import (
    DRIVE,
    QUANTITIES,
    SPRING_REST,
    Quantity,
    Units,
    authored,
    axis_of,
    stated,
)

# From this value on, a float stands for no limit.
_NO_LIMIT = 1e30


def drive_of(prim: Any, where: str, units: Units, *, turns: bool) -> Drive:
    """Return the drive of a joint; raise RobotError for negative numbers."""
    found: dict[Quantity, float] = {}
    for quantity in QUANTITIES:
        for home, value in stated(prim, quantity, units, turns=turns):
            if value < 0:
                raise RobotError(
                    f"{where}: {home.attribute(turns=turns)}: expected zero or more, got {value:g}"
                )
            found.setdefault(quantity, value)
    rest = float(authored(prim, SPRING_REST) or 0.0)
    gains, limit = gains_of(prim, units, turns=turns), force_limit(prim, units, turns=turns)
    kp, kd = gains or (0.0, 0.0)
    return Drive(
        rotor_inertia=found.get("armature", 0.0),
        damping=found.get("damping", 0.0),
        friction=found.get("friction", 0.0),
        spring=found.get("stiffness", 0.0),
        spring_rest_rad=math.radians(rest) if turns else rest * units.length_m,
        servo=(kp, kd) if kp > 0 else None,
        speed_gain=kd if kp == 0 and kd > 0 else None,
        # Without gains the drive has no force, and its limit is none of the commanded torque.
        limit_nm=limit if kp > 0 or kd > 0 else math.inf,
        effort=0.0 if math.isinf(limit) else limit,
        force_limits=(limit if kp > 0 or kd > 0 else math.inf, math.inf),
    )


def gains_of(prim: Any, units: Units, *, turns: bool) -> tuple[float, float] | None:
    """Return the gains on position [Nm/rad] and speed [Nm s/rad] of a force drive; None without one.

    USD states the gains of drives that turn per degree.
    """
    start = DRIVE.format(axis=axis_of(turns=turns))
    kp, kd = (authored(prim, start + name) for name in ("stiffness", "damping"))
    if (kp is None and kd is None) or is_acceleration(prim, turns=turns):
        return None
    unit = units.of("stiffness", turns=turns, per_degree=True)
    return float(kp or 0.0) * unit, float(kd or 0.0) * unit


def is_acceleration(prim: Any, *, turns: bool) -> bool:
    """Whether the gains of a drive make accelerations instead of torques."""
    return bool(authored(prim, DRIVE.format(axis=axis_of(turns=turns)) + "type") == "acceleration")


def force_limit(prim: Any, units: Units, *, turns: bool) -> float:
    """Return the largest torque [Nm] or force [N] of a drive, infinite if the file states none."""
    limit = authored(prim, DRIVE.format(axis=axis_of(turns=turns)) + "maxForce")
    if limit is None or not abs(float(limit)) < _NO_LIMIT:
        return math.inf
    return float(limit) * units.effort(turns=turns)
