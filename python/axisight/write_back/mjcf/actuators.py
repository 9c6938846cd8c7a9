"""MJCF motors with another gain, a lag, a delay or a limit of their torque."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from axisight.effects.stated import LAG, OFFSET, TORQUE_CONSTANT, TORQUE_LIMIT, TRANSPORT_DELAY
from axisight.robot_import.mjcf.actuators import is_gain
from axisight.robot_import.xml_tree import Element
from axisight.write_back.mjcf.limits import LIMIT_EFFECTS, Limits
from axisight.write_back.mjcf.passive import TAG
from axisight.write_back.mjcf.servos import (
    DELAYS_SINCE,
    SERVO,
    SERVO_EFFECTS,
    Servo,
    delayed,
    is_servo,
    write_servo,
)
from axisight.write_back.mjcf.versions import too_old
from axisight.write_back.placed import Placed, said
from axisight.write_back.refitted import Refitted
from axisight.write_back.xml_edits import Edits, Numbers

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

# Attributes of a <general> that is a <motor> with a gain.
_MOTOR = {"gaintype": "fixed", "biastype": "none", "dyntype": "none"}
# Attribute values that a lag adds.
_LAGS = {"dyntype": ("filter", "filterexact")}
# Attributes by which an actuator names its joint; equivalent on joints with one axis.
_JOINTS = ("joint", "jointinparent")
_NO_GAINS = f"expected a <{SERVO}> of the joint, whose gains the file says"
# MuJoCo's default time step.
_STEP_S = 0.002


def _limit(value: float) -> Mapping[str, Numbers]:
    return {"ctrllimited": "true", "ctrlrange": (-value, value)}


def _gain(value: float, _step_s: float) -> Mapping[str, Numbers]:
    return {"gainprm": 1 + value}


def _biased(value: float) -> Mapping[str, Numbers]:
    """Return the attributes of an actuator with a constant torque ``value`` [Nm]."""
    return {"biastype": "affine", "biasprm": (value, 0.0, 0.0)}


def _lag(value: float, _step_s: float) -> Mapping[str, Numbers]:
    return {"dyntype": "filterexact", "dynprm": value}


_ATTRIBUTES: Mapping[str, tuple[str, Callable[[float, float], Mapping[str, Numbers]]]] = {
    TORQUE_CONSTANT[0]: (TORQUE_CONSTANT[1], _gain),
    LAG[0]: (LAG[1], _lag),
    TRANSPORT_DELAY[0]: (TRANSPORT_DELAY[1], delayed),
}
# Apart from `_ATTRIBUTES`, because they must be converted to the side before the file's gear.
_OF_MOTORS = frozenset((*_ATTRIBUTES, TORQUE_LIMIT[0], OFFSET[0]))
# A motor with a current controller has its lag as a time constant of the current.
_OF_DCMOTORS = frozenset((LAG[0], TRANSPORT_DELAY[0], TORQUE_LIMIT[0]))
DRIVE_EFFECTS = _OF_MOTORS.union(SERVO_EFFECTS)


def write_drive(
    edits: Edits,
    root: Element,
    joint: tuple[str, Element | None],
    found: tuple[Sequence[Cause], Sequence[Refitted]],
    limits: Limits,
) -> Placed:
    """Write the findings on one joint into its actuator; the gear ratio in ``gear`` stays.

    ``joint``: its name and its element, None if that is in another file. ``found``: causes and re-fitted
    gains.

    MuJoCo delays, limits, lags and amplifies a command in the order of a torque path. A <motor> has neither
    gain nor lag, so it becomes the <general> that it abbreviates, with explicit values against the file's
    defaults.
    """
    holders = [e for e in root.walk() if e.tag == "actuator"]
    mine = [e for h in holders for e in h.children if _drives(e, joint[0])]
    refitted = found[1]
    placed, causes = _possible(found[0], limits, joint[1])
    if len(mine) == 1 and is_servo(mine[0], limits):
        servo = Servo(mine[0], joint[1], limits, _has_ratio_defaults(root))
        return placed.joined(write_servo(edits, servo, causes, refitted, step_of(root)))
    placed.refuse(refitted, _NO_GAINS)
    placed.refuse([cause for cause in causes if cause.effect not in _OF_MOTORS], _NO_GAINS)
    causes = [cause for cause in causes if cause.effect in _OF_MOTORS]
    defaults = any(e.tag in ("default", "include") for e in root.walk())
    if len(mine) == 1 and _is_told_torque(mine[0]):
        beyond = [cause for cause in causes if cause.effect not in _OF_DCMOTORS]
        placed.refuse(beyond, f"a <{TAG}> delivers the torque that it is told")
        causes = [cause for cause in causes if cause.effect in _OF_DCMOTORS]
    elif len(mine) != 1 or mine[0].children or not _is_motor(mine[0], defaults):
        got = "none" if not mine else ", ".join(f"<{e.tag}>" for e in mine)
        placed.refuse(causes, f"expected one motor of the joint that has a gain, got {got}")
        causes = []
    if causes:
        _write_motor(edits, mine[0], joint[1], causes, limits, step_of(root), defaults=defaults)
        placed.take(causes)
    return placed


def _possible(
    causes: Sequence[Cause], limits: Limits, joint: Element | None
) -> tuple[Placed, list[Cause]]:
    """Return the causes that limits and version of MuJoCo allow, and why not the others."""
    placed = Placed()
    beyond = [cause for cause in causes if cause.effect in LIMIT_EFFECTS]
    if beyond and (why := _cannot_limit(limits, joint)):
        placed.refuse(beyond, why)
    constant = [cause for cause in causes if cause.effect == OFFSET[0]]
    if constant and any(x != math.inf for x in limits.drive.force_limits):
        placed.refuse(constant, "the file limits the force of the motor, which would include it")
    late = [cause for cause in causes if cause.effect == TRANSPORT_DELAY[0]]
    if late and (why := too_old(DELAYS_SINCE, "delays of actuators")):
        placed.refuse(late, why)
    return placed, [cause for cause in causes if cause.label not in placed.why_not]


def _write_motor(
    edits: Edits,
    motor: Element,
    joint: Element | None,
    causes: Sequence[Cause],
    limits: Limits,
    step_s: float,
    *,
    defaults: bool,
) -> None:
    """Write causes into a motor; ``defaults``: the file may have defaults for actuators."""
    made: dict[str, Numbers] = {}
    # The last cause of a kind replaces the simulator's effect.
    for cause in causes:
        if cause.effect == TORQUE_LIMIT[0]:
            made |= _limit(limits.of_actuator(cause.parameters[TORQUE_LIMIT[1]].value))
        elif cause.effect == OFFSET[0]:
            made |= _biased(limits.signed(cause.parameters[OFFSET[1]].value))
        elif cause.effect == LAG[0] and motor.tag == TAG:
            made["inductance"] = (0.0, cause.parameters[LAG[1]].value)
        else:
            name, attributes = _ATTRIBUTES[cause.effect]
            made |= attributes(cause.parameters[name].value, step_s)
    behind, of_joint = limits.set_by(causes, servo=False)
    made |= behind
    if of_joint and joint is not None:
        edits.set(joint, of_joint, said([c for c in causes if c.effect in LIMIT_EFFECTS]))
    kind = ""
    if made.keys() & {"gainprm", "dyntype", "biasprm"}:
        kind = "general"
        usual = {"gainprm": "1", **_MOTOR} if defaults and motor.tag == "motor" else {}
        made |= {key: value for key, value in usual.items() if key not in made}
    edits.set(motor, made, said(causes), tag=kind)


def _is_told_torque(element: Element) -> bool:
    """Return whether an actuator is a DC motor whose only input is its torque."""
    told = element.attributes.get("input", "").split()
    return element.tag == TAG and told == ["ff"] and "controller" not in element.attributes


def _drives(element: Element, joint: str) -> bool:
    """Return whether an actuator acts on a joint and has a command."""
    acts = joint in map(element.attributes.get, _JOINTS)
    return acts and element.attributes.get("input") != "none"


def _cannot_limit(limits: Limits, joint: Element | None) -> str:
    """Return why a limit cannot be written; empty if it can."""
    if not limits.alike:
        return "expected limits of force in the file that are the same both ways"
    if joint is None and math.isfinite(limits.drive.force_limits[1]):
        return "the joint, which limits the force of its actuators, stands in another file"
    return ""


def step_of(root: Element) -> float:
    """Return the time step of a model [s]."""
    steps = [e.attributes["timestep"] for e in root.all("option") if "timestep" in e.attributes]
    return float(steps[-1]) if steps else _STEP_S


def _has_ratio_defaults(root: Element) -> bool:
    """Return whether the file's defaults have a damping ratio, which excludes a speed gain."""
    defaults = [e for e in root.walk() if e.tag == "default"]
    return any("dampratio" in e.attributes for d in defaults for e in d.walk())


def _is_motor(element: Element, defaults: bool) -> bool:
    """Return whether an actuator is a source of torque with a stated or unit gain.

    ``defaults``: the file may have defaults for actuators.
    """
    if element.tag == "motor":
        return True
    said_so = {key: element.attributes.get(key) for key in _MOTOR}
    # A bias that is constant is a torque beside the command.
    if element.attributes.get("biastype") == "affine":
        further = element.attributes.get("biasprm", "0").split()[1:]
        said_so["biastype"] = "affine" if any(map(float, further)) else _MOTOR["biastype"]
    usual = all(value in (None, _MOTOR[key], *_LAGS.get(key, ())) for key, value in said_so.items())
    sure = not defaults or None not in said_so.values()
    gain = element.attributes.get("gainprm", "1").split()
    return (
        element.tag == "general" and usual and sure and len(gain) == 1 and is_gain(float(gain[0]))
    )
