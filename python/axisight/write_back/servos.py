"""Actuators of an MJCF with targets of positions: other gains, less torque, a limit of it, late targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from axisight.effects.stated import OTHER_GAINS, TORQUE_CONSTANT, TORQUE_LIMIT, TRANSPORT_DELAY
from axisight.robot_import.xml_tree import Element
from axisight.write_back.limits import Limits
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits, Numbers

if TYPE_CHECKING:
    from axisight.gap.result import Cause

SERVOS = ("position", "intvelocity", "velocity")
"""Tags of such actuators, and of one that is told speeds, of which only the limit is known."""

SERVO_EFFECTS = (OTHER_GAINS[0], TORQUE_CONSTANT[0], TRANSPORT_DELAY[0], TORQUE_LIMIT[0])
"""What their attributes say: ``kp`` and ``kv`` times what is found, ``delay`` of targets, ``forcerange``."""

_OF_GAINS = (OTHER_GAINS[0], TORQUE_CONSTANT[0])


def delayed(value: float, step_s: float) -> Mapping[str, Numbers]:
    """Return the attributes of an actuator whose commands act late [s], in a model of a time step [s]."""
    # As many commands are kept as lie within the delay; between two of them it acts for a part of a step.
    kept = math.ceil(value / step_s - 1e-9) + 1
    return {"delay": value, "nsample": str(kept), "interp": "linear"}


def write_servo(
    edits: Edits,
    elements: tuple[Element, Element | None],
    causes: Sequence[Cause],
    step_s: float,
    limits: Limits | None,
) -> Placed:
    """Write what causes of one joint make of its only actuator, which has a target of positions.

    ``elements``: actuator and joint; ``limits``: of the joint, where a cause changes them.
    """
    placed, (actuator, joint) = Placed(), elements
    tag = f"<{actuator.tag}>"
    known = SERVO_EFFECTS if actuator.tag != "velocity" else (TORQUE_LIMIT[0],)
    other = [cause for cause in causes if cause.effect not in known]
    has = "gains, a delay and a limit" if len(known) > 1 else "a limit, its law is none here"
    placed.refuse(other, f"expected a motor, {tag} has {has}")
    mine = [cause for cause in causes if cause.effect in known]
    gains = [cause for cause in mine if cause.effect in _OF_GAINS]
    if gains and ("kp" not in actuator.attributes or "dampratio" in actuator.attributes):
        placed.refuse(gains, f"expected kp of the {tag}, and kv if any, instead of defaults")
        mine = [cause for cause in mine if cause not in gains]
        gains = []
    made: dict[str, Numbers] = {}
    for late in (cause for cause in mine if cause.effect == TRANSPORT_DELAY[0]):
        made |= delayed(late.parameters[TRANSPORT_DELAY[1]].value, step_s)
    for key, factor in zip(("kp", "kv"), _factors(gains), strict=True):
        if gains and key in actuator.attributes:
            made[key] = float(actuator.attributes[key]) * factor
    if limits is not None and mine:
        behind, of_joint = limits.set_by(mine, servo=True)
        made |= behind
        if of_joint and joint is not None:
            edits.set(joint, of_joint)
    if mine:
        edits.set(actuator, made, said(mine))
        placed.take(mine)
    return placed


def _factors(causes: Sequence[Cause]) -> tuple[float, float]:
    """Return what gains of position and of speed are times those that the file says."""
    position = speed = 1.0
    for cause in causes:
        found = {name: value.value for name, value in cause.parameters.items()}
        if cause.effect == OTHER_GAINS[0]:
            # Of a law of targets the second gain is that of the speed.
            position *= 1 + found.get(OTHER_GAINS[1][0], 0.0)
            speed *= 1 + found.get(OTHER_GAINS[1][1], 0.0)
        else:
            both = 1 + found[TORQUE_CONSTANT[1]]
            position, speed = position * both, speed * both
    return position, speed
