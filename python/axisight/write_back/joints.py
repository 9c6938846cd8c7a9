"""Values of joints: friction, damping, armature, springs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from axisight.effects import effect_info
from axisight.effects.stated import (
    DRAG,
    DRY_FRICTION,
    JOINT_SPRING,
    MOTOR_INERTIA,
    ROTOR,
    VISCOUS_FRICTION,
)
from axisight.robot import Robot
from axisight.robot_import.bodies import Drive
from axisight.robot_import.xml_tree import Element
from axisight.write_back.frames import angle_unit
from axisight.write_back.mjcf.versions import too_old
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits, Numbers

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

DRAG_NUMBER = "drag"
"""Name for the second coefficient of ``damping``."""
POLYNOMIALS_SINCE = (3, 7)
"""First version of MuJoCo with several coefficients of ``damping`` and ``stiffness``."""
# Numbers that joints and actuators can both have.
_SHARED = ("armature", "damping", DRAG_NUMBER)

JOINT_NUMBERS = {
    "robot": {DRY_FRICTION[0]: "friction", VISCOUS_FRICTION: "damping"},
    "mujoco": {
        DRY_FRICTION[0]: "frictionloss",
        VISCOUS_FRICTION: "damping",
        ROTOR: "armature",
        MOTOR_INERTIA: "armature",
        JOINT_SPRING[0]: "stiffness",
        DRAG[0]: DRAG_NUMBER,
    },
}
"""Effects that are a number on the model's joints, by the root tag of the file."""


def write_joint(
    edits: Edits,
    root: Element,
    joint: Element,
    robot: Robot,
    axis: int,
    causes: Sequence[Cause],
    drive: Drive | None,
) -> Placed:
    """Write causes of one axis (from 0) that are numbers of its joint, with one comment.

    ``drive``: that of an MJCF. What the file states on actuators stays there.
    """
    placed, drive = Placed(), drive or Drive()
    of_actuators = dict(zip(_SHARED, drive.of_actuators, strict=True))
    by_number: dict[str, list[Cause]] = {}
    for cause in causes:
        by_number.setdefault(JOINT_NUMBERS[root.tag][cause.effect], []).append(cause)
    numbers: dict[str, float] = {}
    for name, mine in by_number.items():
        value = joint_number(robot, axis, mine) - of_actuators.get(name, 0.0)
        why = too_old(POLYNOMIALS_SINCE, "drag of joints") if name == DRAG_NUMBER else ""
        if why:
            placed.refuse(mine, why)
        elif value < 0:
            placed.refuse(mine, f"{name} would be {value:.4g}, and models have none below zero")
        elif name == "stiffness" and value == 0 and torque_at_zero(mine[-1]):
            placed.refuse(mine, "without stiffness a spring rests nowhere")
        else:
            numbers[name] = value
            if name == "stiffness":
                unit = 1.0 if robot.axis_is_prismatic[axis] else angle_unit(root)
                numbers |= _rest(joint, torque_at_zero(mine[-1]), value, unit)
            placed.take(mine)
    there = [cause for cause in causes if cause.label in placed.there]
    if there:
        _edit(edits, root.tag, joint, _coefficients(numbers, drive), said(there))
    return placed


def joint_number(robot: Robot, axis: int, causes: Sequence[Cause]) -> float:
    """Return the number [SI units, joint side] that results from causes on the same number of an axis (from 0)."""
    ratio = abs(float(robot.gear_ratio[axis]))
    first = effect_info(causes[0].effect)
    if first.stands_for is None:
        # The cause replaces the simulator's effect.
        value = next(iter(causes[-1].parameters.values())).value
        if causes[-1].effect == DRAG[0]:
            return value / ratio**3
        return value / ratio if first.acts == "motor" else value
    name = robot.axis_parameter(axis + 1, first.stands_for[0])
    value = 0.0 if name is None else robot.parameters()[name]
    for cause in causes:
        change = next(iter(cause.parameters.values())).value
        of = effect_info(cause.effect).stands_for
        value = value * (1 + change) if of is not None and of[1] == "relative" else value + change
    return value / ratio**2


def _coefficients(numbers: Mapping[str, float], drive: Drive) -> Mapping[str, Numbers]:
    """Return the attributes with the numbers of a joint; damping and spring keep their further coefficients."""
    out: dict[str, Numbers] = {k: v for k, v in numbers.items() if k != DRAG_NUMBER}
    quadratic, cubic = drive.damping_beyond
    if DRAG_NUMBER in numbers or ("damping" in numbers and (quadratic or cubic)):
        linear = numbers.get("damping", drive.damping - drive.of_actuators[1])
        out["damping"] = (linear, numbers.get(DRAG_NUMBER, quadratic), cubic)
    if "stiffness" in numbers and any(drive.spring_beyond):
        out["stiffness"] = (numbers["stiffness"], *drive.spring_beyond)
    return out


def torque_at_zero(spring: Cause) -> float:
    """Return the torque of a spring [Nm] with its joint at zero."""
    found = spring.parameters.get(JOINT_SPRING[2])
    return 0.0 if found is None else found.value


def _rest(joint: Element, at_zero: float, stiffness: float, unit: float) -> dict[str, float]:
    """Return the reference of a spring in units of ``unit`` per radian; empty if none is needed."""
    if at_zero == 0:
        return {"springref": 0.0} if "springref" in joint.attributes else {}
    return {"springref": at_zero / stiffness * unit}


def _edit(
    edits: Edits, root: str, joint: Element, numbers: Mapping[str, Numbers], comment: str
) -> None:
    if root == "mujoco":
        edits.set(joint, numbers, comment)
        return
    dynamics = joint.find("dynamics")
    if dynamics is not None:
        edits.set(dynamics, numbers, comment)
    else:
        edits.add(joint, "dynamics", numbers, comment)
