"""MJCF actuators with position targets: other gains, less torque, a torque limit, late targets."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from axisight.effects.stated import (
    OFFSET,
    OTHER_GAINS,
    TORQUE_CONSTANT,
    TORQUE_LIMIT,
    TRANSPORT_DELAY,
)
from axisight.robot_import.xml_tree import Element
from axisight.write_back.mjcf.limits import LIMIT_EFFECTS, Limits
from axisight.write_back.placed import Labelled, Placed, said
from axisight.write_back.refitted import Refitted, factors
from axisight.write_back.xml_edits import Edits, Numbers

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

SERVO = "position"
"""Tag of the most common actuator with a target."""

_TOLD_SPEEDS = "velocity"
_OF_VOLTAGES = "dcmotor"
_WITH_SUM = "pid"
# <intvelocity> integrates speeds to a position target.
_TAGS = (SERVO, "intvelocity", _TOLD_SPEEDS, _WITH_SUM)
_GENERAL = "general"

SERVO_EFFECTS = (
    OTHER_GAINS[0],
    TORQUE_CONSTANT[0],
    TRANSPORT_DELAY[0],
    TORQUE_LIMIT[0],
    OFFSET[0],
)
"""Effects that attributes express: factors on gains, ``delay`` of targets, ``forcerange``, a bias."""

_OF_GAINS = (OTHER_GAINS[0], TORQUE_CONSTANT[0])


@dataclass(frozen=True)
class Servo:
    """The only actuator of a joint: its element, the joint's (None if in another file), and its limits.

    ``ratio_defaults``: the file has a default damping ratio.
    """

    element: Element
    joint: Element | None
    limits: Limits
    ratio_defaults: bool

    @property
    def known(self) -> Sequence[str]:
        """Effects that the actuator has attributes for."""
        return (TORQUE_LIMIT[0],) if self.element.tag == _TOLD_SPEEDS else SERVO_EFFECTS


def is_servo(element: Element, limits: Limits) -> bool:
    """Return whether the only actuator of a joint has a target, and is no motor."""
    of_law = element.tag in (_GENERAL, _OF_VOLTAGES) and limits.drive.servo is not None
    return element.tag in _TAGS or of_law


DELAYS_SINCE = (3, 5)
"""First version of MuJoCo with delays of actuators and sensors."""


def delayed(value: float, step_s: float) -> Mapping[str, Numbers]:
    """Return the attributes of an actuator with a delay ``value`` [s]; ``step_s`` [s]: of the model."""
    # One buffered command per step within the delay, and one more to interpolate within a step.
    kept = math.ceil(value / step_s - 1e-9) + 1
    return {"delay": value, "nsample": str(kept), "interp": "linear"}


def write_servo(
    edits: Edits,
    servo: Servo,
    causes: Sequence[Cause],
    refitted: Sequence[Refitted],
    step_s: float,
) -> Placed:
    """Write causes and re-fitted gains of one joint into its only actuator, which has a target."""
    placed = Placed()
    for those, why in _impossible(servo, causes, refitted):
        placed.refuse(those, why)
    mine = [cause for cause in causes if cause.label not in placed.why_not]
    found = [gain for gain in refitted if gain.label not in placed.why_not]
    gains = [cause for cause in mine if cause.effect in _OF_GAINS]
    made: dict[str, Numbers] = {}
    for late in (cause for cause in mine if cause.effect == TRANSPORT_DELAY[0]):
        made |= delayed(late.parameters[TRANSPORT_DELAY[1]].value, step_s)
    if gains or found:
        made |= _gains(servo, gains, found)
    behind, of_joint = servo.limits.set_by(mine, servo=True)
    made |= _as_saturation(servo, behind)
    if of_joint and servo.joint is not None:
        edits.set(servo.joint, of_joint, said([c for c in mine if c.effect in LIMIT_EFFECTS]))
    if mine or found:
        without = {"dampratio"} if "kv" in made else set()
        tag = ""
        for constant in (cause for cause in mine if cause.effect == OFFSET[0]):
            by = servo.limits.signed(constant.parameters[OFFSET[1]].value)
            tag, without = _GENERAL, {"kp", "kv", "dampratio"}
            made = _biased(
                servo, by, {k: x for k, x in made.items() if k not in without}, gains, found
            )
        comment = said(mine, [gain.words for gain in found])
        edits.set(servo.element, made, comment, without=without, tag=tag)
        placed.take([*mine, *found])
    return placed


def _impossible(
    servo: Servo, causes: Sequence[Cause], refitted: Sequence[Refitted]
) -> Iterator[tuple[Sequence[Labelled], str]]:
    """Yield causes and re-fitted gains that an actuator cannot express, and why."""
    tag = f"<{servo.element.tag}>"
    has = "gains, a delay and a limit" if len(servo.known) > 1 else "a limit, its law is none here"
    yield (
        [cause for cause in causes if cause.effect not in servo.known],
        f"expected a motor, {tag} has {has}",
    )
    if servo.limits.drive.sums_up:
        yield (
            [cause for cause in causes if cause.effect == TRANSPORT_DELAY[0]],
            f"expected a servo that is told positions, {tag} delays speeds before it sums them up",
        )
    constant = [cause for cause in causes if cause.effect == OFFSET[0]]
    if servo.element.tag not in (SERVO, _GENERAL) or servo.limits.drive.sums_up:
        yield constant, f"expected a <{SERVO}> or a motor, {tag} has no constant torque"
    elif any(x != math.inf for x in servo.limits.drive.force_limits):
        yield constant, f"the file limits the force of the {tag}, which would include it"
    gains = [c for c in causes if c.effect in _OF_GAINS and c.effect in servo.known]
    if servo.limits.drive.servo is None:
        # The tag is right, but the controller's law has no filter of its command, and no integral.
        beyond = "ki or slewmax" if servo.element.tag == _WITH_SUM else "timeconst"
        yield [*gains, *refitted, *constant], f"{tag} is no plain servo ({beyond})"
    elif servo.ratio_defaults:
        yield [*gains, *refitted], f"expected kv of the {tag} instead of a dampratio in defaults"


def _gains(
    servo: Servo, causes: Sequence[Cause], refitted: Sequence[Refitted]
) -> Mapping[str, Numbers]:
    """Return the attributes of changed gains; the file's gains are those of MuJoCo, with defaults."""
    stated = servo.limits.drive.servo
    assert stated is not None  # gains of others were refused
    kp, kv = _changed(stated, causes, refitted)
    if servo.element.tag == _GENERAL:
        return {"gainprm": kp, "biasprm": (servo.limits.drive.offset_nm, -kp, -kv)}
    if servo.element.tag == _OF_VOLTAGES:
        return {"controller": (kp, 0.0, kv)}
    made: dict[str, Numbers] = {}
    if kp != stated[0]:
        made["kp"] = kp
    if kv != stated[1] or "dampratio" in servo.element.attributes:
        made["kv"] = kv
    return made


def _changed(
    stated: tuple[float, float], causes: Sequence[Cause], refitted: Sequence[Refitted]
) -> tuple[float, float]:
    """Return the gains of position and speed with causes and re-fitted changes."""
    by_cause, by_fit = factors_of(causes), factors(refitted)
    kp, kv = (x * a * b for x, a, b in zip(stated, by_cause, by_fit, strict=True))
    return kp, kv


def _biased(
    servo: Servo,
    offset_nm: float,
    made: Mapping[str, Numbers],
    gains: Sequence[Cause],
    found: Sequence[Refitted],
) -> dict[str, Numbers]:
    """Return the attributes of a <general> that is the servo with a constant torque beside ``made``."""
    stated = servo.limits.drive.servo
    assert stated is not None  # the offset of others was refused
    kp, kv = _changed(stated, gains, found)
    return {
        **made,
        "gaintype": "fixed",
        "biastype": "affine",
        "dyntype": "none",
        "gainprm": kp,
        "biasprm": (offset_nm, -kp, -kv),
    }


def _as_saturation(servo: Servo, limit: Mapping[str, Numbers]) -> Mapping[str, Numbers]:
    """Return the attributes of a force limit, which a <dcmotor> has under a name of its own."""
    if servo.element.tag != _OF_VOLTAGES or "forcerange" not in limit:
        return limit
    both = limit["forcerange"]
    assert not isinstance(both, str | float | int)  # limits are two numbers
    return {"saturation": (both[1], 0.0, 0.0)}


def factors_of(causes: Sequence[Cause]) -> tuple[float, float]:
    """Return the factors of causes on the file's gains of position and speed."""
    position = speed = 1.0
    for cause in causes:
        found = {name: value.value for name, value in cause.parameters.items()}
        if cause.effect == OTHER_GAINS[0]:
            # In a law with position targets the second gain is that of speed.
            position *= 1 + found.get(OTHER_GAINS[1][0], 0.0)
            speed *= 1 + found.get(OTHER_GAINS[1][1], 0.0)
        else:
            both = 1 + found[TORQUE_CONSTANT[1]]
            position, speed = position * both, speed * both
    return position, speed
