"""Numbers of USD joints, at the attributes of every engine and in its law of friction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from axisight.effects.stated import (
    DRY_FRICTION,
    JOINT_SPRING,
    LEAD,
    MOTOR_INERTIA,
    ROTOR,
    VISCOUS_FRICTION,
)
from axisight.robot import Robot
from axisight.robot_import.usd.attributes import (
    CONSTRAINT_IMPEDANCE,
    CONSTRAINT_SPRING,
    HOMES,
    SPRING_REST,
    STATIC_FRICTION,
    Home,
    Quantity,
    Units,
    authored,
    axis_of,
)
from axisight.write_back.joints import joint_number, torque_at_zero
from axisight.write_back.placed import Placed, said
from axisight.write_back.usd.layer import Overlay

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

QUANTITY_OF: Mapping[str, Quantity] = {
    DRY_FRICTION[0]: "friction",
    VISCOUS_FRICTION: "damping",
    ROTOR: "armature",
    MOTOR_INERTIA: "armature",
    JOINT_SPRING[0]: "stiffness",
}
"""Effects that are a number on the joints of a USD stage."""

# Friction of old PhysX, a share of the load of the joint. A friction effort replaces it.
_LOAD_FRICTION = "physxJoint:jointFriction"
# MuJoCo's largest impedance, at which a joint at rest creeps least, and a rate [1/s] at which friction
# takes away speed. The rate is stable for time steps below twice its inverse.
_IMPEDANCE = 0.9999
_RATE = 200.0
_FLOAT, _DOUBLES = "float", "double[]"


def write_joint(
    overlay: Overlay,
    prim: Any,
    units: Units,
    robot: Robot,
    axis: int,
    causes: Sequence[Cause],
) -> Placed:
    """Write causes of one axis (from 0) that are numbers of its joint ``prim``."""
    placed, turns = Placed(), not robot.axis_is_prismatic[axis]
    by_quantity: dict[Quantity, list[Cause]] = {}
    for cause in causes:
        by_quantity.setdefault(QUANTITY_OF[cause.effect], []).append(cause)
    for quantity, mine in by_quantity.items():
        value = joint_number(robot, axis, mine)
        if value < 0:
            placed.refuse(mine, f"{quantity} would be {value:.4g}, and models have none below zero")
            continue
        is_spring = quantity == "stiffness"
        if is_spring and (why := _rest(overlay, prim, units, value, mine[-1], turns=turns)):
            placed.refuse(mine, why)
            continue
        if quantity == "friction":
            _friction_laws(overlay, prim, units, value, mine[-1], turns=turns)
        for home in _homes(prim, quantity, turns=turns):
            overlay.apply(prim, home.schema(turns=turns))
            unit = units.of(quantity, turns=turns, per_degree=home.per_degree)
            overlay.set(prim, home.attribute(turns=turns), value / unit, _FLOAT, said(mine))
        placed.take(mine)
    return placed


def _homes(prim: Any, quantity: Quantity, *, turns: bool) -> list[Home]:
    """Return where to write a quantity: one attribute per engine, and all that the file states.

    MuJoCo's own attributes are needed only if nothing else states the quantity: Newton hands its own to MuJoCo.
    """
    engines: set[str] = set()
    out = []
    for home in HOMES[quantity]:
        first = home.engine not in engines and (home.engine != "MuJoCo" or not engines)
        if first or authored(prim, home.attribute(turns=turns)) is not None:
            engines.add(home.engine)
            out.append(home)
    return out


def _friction_laws(
    overlay: Overlay, prim: Any, units: Units, value: float, cause: Cause, *, turns: bool
) -> None:
    """Write dry friction in the laws of PhysX and of Newton's solver MuJoCo.

    PhysX holds a joint at rest up to the static effort. In Newton's solver friction is a soft constraint, under
    which a joint creeps; with the largest impedance the creep is below a thousandth of the default's.
    """
    effort = value / units.effort(turns=turns)
    static = STATIC_FRICTION.format(axis=axis_of(turns=turns))
    overlay.set(prim, static, effort, _FLOAT, said([cause]))
    if authored(prim, _LOAD_FRICTION):
        overlay.set(prim, _LOAD_FRICTION, 0.0, _FLOAT, "axisight: replaced by a friction effort")
    lead = cause.parameters.get(LEAD)
    rate = _RATE if lead is None or lead.value <= 0 else 1.0 / lead.value
    why = "axisight: friction that holds at rest in Newton's solver MuJoCo"
    # Not positive numbers state the rate itself, times the impedance.
    overlay.set(prim, CONSTRAINT_SPRING, [0.0, -rate * _IMPEDANCE], _DOUBLES, why)
    overlay.set(
        prim, CONSTRAINT_IMPEDANCE, [_IMPEDANCE, _IMPEDANCE, 0.001, 0.5, 2.0], _DOUBLES, why
    )


def _rest(
    overlay: Overlay, prim: Any, units: Units, stiffness: float, spring: Cause, *, turns: bool
) -> str:
    """Write where a spring rests; return why that failed, else empty."""
    at_zero = torque_at_zero(spring)
    if at_zero == 0 and authored(prim, SPRING_REST) is None:
        return ""
    if stiffness == 0:
        return "" if at_zero == 0 else "without stiffness a spring rests nowhere"
    rest = at_zero / stiffness
    rest = math.degrees(rest) if turns else rest / units.length_m
    overlay.set(prim, SPRING_REST, rest, _FLOAT)
    return ""
