"""Drives of USD joints with position targets: other gains, less torque, a torque limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from axisight.effects.stated import OTHER_GAINS, TORQUE_CONSTANT, TORQUE_LIMIT
from axisight.robot_import.usd.attributes import DRIVE, Units, axis_of
from axisight.write_back.mjcf.limits import LIMIT_EFFECTS, Limits
from axisight.write_back.mjcf.servos import factors_of
from axisight.write_back.placed import Placed, said
from axisight.write_back.refitted import Refitted, factors
from axisight.write_back.usd.layer import Overlay

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

DRIVE_EFFECTS = frozenset((OTHER_GAINS[0], TORQUE_CONSTANT[0], TORQUE_LIMIT[0]))
"""Effects that are numbers of a drive with position targets."""

_NO_SERVO = "expected a drive of the joint with position targets (PhysicsDriveAPI with a stiffness)"


def write_drive(
    overlay: Overlay,
    prim: Any,
    units: Units,
    limits: Limits,
    causes: Sequence[Cause],
    refitted: Sequence[Refitted],
    *,
    turns: bool,
) -> Placed:
    """Write causes and re-fitted gains of one axis into the drive of its joint ``prim``."""
    placed = Placed()
    servo = limits.drive.servo
    if servo is None:
        placed.refuse([*causes, *refitted], _NO_SERVO)
        return placed
    start = DRIVE.format(axis=axis_of(turns=turns))
    comment = said(causes, [gain.words for gain in refitted])
    gained = [cause for cause in causes if cause.effect != TORQUE_LIMIT[0]]
    if gained or refitted:
        unit = units.of("stiffness", turns=turns, per_degree=True)
        by_cause, by_fit = factors_of(gained), factors(refitted)
        for name, stated, a, b in zip(
            ("stiffness", "damping"), servo, by_cause, by_fit, strict=True
        ):
            if a * b != 1:
                overlay.set(prim, start + name, stated * a * b / unit, "float", comment)
    limit = _limit(limits, causes)
    if math.isfinite(limit):
        overlay.set(prim, start + "maxForce", limit / units.effort(turns=turns), "float", comment)
    placed.take([*causes, *refitted])
    return placed


def _limit(limits: Limits, causes: Sequence[Cause]) -> float:
    """Return the force limit [Nm or N, joint side] that causes set; infinite if they set none.

    A drive limits its force after the gains, so a motor with less torque needs a smaller limit.
    """
    if not any(cause.effect in LIMIT_EFFECTS for cause in causes):
        return math.inf
    most, gain = limits.own_nm, 1.0
    for cause in causes:
        if cause.effect == TORQUE_LIMIT[0]:
            most = cause.parameters[TORQUE_LIMIT[1]].value
        elif cause.effect == TORQUE_CONSTANT[0]:
            gain = 1 + cause.parameters[TORQUE_CONSTANT[1]].value
    return limits.of_actuator(most) * gain
