"""Sets aside joint encoders that do not show the joint behind their motor: wrong sign, unit, scale or axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_controller.follows_reference import FOLLOWS, SIZE
from axisight.gap.gate.by_dynamics.axis_travel import travels
from axisight.gap.signals.both_encoders import joint_torque, stiffnesses
from axisight.gap.signals.unit_scales import TOLERANCE, scale_name
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

_ASIDE = "The joint encoder of this axis is not used"


def without_unlike_encoders(
    robot: Robot, logs: Sequence[Log]
) -> tuple[list[Log], tuple[Finding, ...]]:
    """Return logs with NaN in place of joint encoders that contradict the motors, and a flag for each such axis.

    An axis is set aside in all logs if one log shows it: the column is the same in all. A constant offset is no
    fault, since only changes of these positions are used.
    """
    found: dict[int, Finding] = {}
    for log in logs:
        for finding in _unlike(robot, log):
            found.setdefault(finding.axis or 0, finding)
    aside = [axis - 1 for axis in found]
    if not aside:
        return list(logs), ()
    return [_without(log, aside) for log in logs], tuple(found[axis] for axis in sorted(found))


def _without(log: Log, aside: Sequence[int]) -> Log:
    if log.joint_position_rad is None:
        return log
    left = log.joint_position_rad.copy()
    left[:, aside] = np.nan
    return replace(log, joint_position_rad=None if np.isnan(left).all() else left)


def _unlike(robot: Robot, log: Log) -> list[Finding]:
    """Return a flag for each axis of a log whose joint encoder contradicts its motor."""
    if log.joint_position_rad is None or log.n_axes != robot.n_axes:
        return []
    angle = log.position_rad * robot.gear_ratio
    torque = joint_torque(replace(log, joint_position_rad=None), robot)
    # Where an axis travels less, its gear's deflection would pass for a scale.
    stiff = np.std(torque, axis=0) / stiffnesses(robot) < TOLERANCE * np.std(angle, axis=0)
    out = []
    for i in np.flatnonzero(travels(log) & stiff):
        joint = log.joint_position_rad[:, i]
        if np.isfinite(joint).all() and (fault := _fault(angle[:, i], joint, torque[:, i])):
            name, message = fault
            field = f"joint_position_{i + 1}"
            out.append(Finding(name, "flag", f"{message}. {_ASIDE}", log.name, int(i) + 1, field))
    return out


def _fault(angle: Array, joint: Array, torque: Array) -> tuple[str, str] | None:
    """Return name and message of the fault of a joint encoder (n,) [rad]; None if it has none.

    ``angle``: of the motor, joint side [rad]; ``torque``: in the gear [Nm].
    """
    if np.ptp(joint) == 0:
        return (
            "channel_constant",
            f"expected a joint that moves with its motor, got {joint[0]:.4g} rad throughout",
        )
    alike = float(np.corrcoef(angle, joint)[0, 1])
    if abs(alike) < FOLLOWS:
        return "axes_swapped", (
            f"expected a joint that moves with its motor, got a correlation of {alike:.2g}. "
            "It may belong to another axis"
        )
    factor = _factor(angle, joint, torque)
    if factor is None:
        return None
    name = scale_name("position", factor, 1.0)
    if factor < 0 and name == "position_scaled":
        name = "sign_flipped"
    return (
        name,
        f"expected a joint that moves as far as its motor, got one that moves {factor:.4g} times as far",
    )


def _factor(angle: Array, joint: Array, torque: Array) -> float | None:
    """Return the factor [1] by which a joint encoder is too large; None if its scale is right.

    A gear deflects with the torque in it, by its stiffness and by its play. A wrong scale shows as a deflection that
    goes with the angle. A factor near one counts as wrong in two cases:

    - It is far from one beside the torque, and torque and angle differ in shape.
    - The angle alone leaves less than half the rms error of the deflection that the torque leaves.
    """
    one, both_ways, apart = np.ones_like(angle), np.sign(torque), angle - joint
    (_, slope), by_angle = _fitted(joint, one, angle)
    if not SIZE[0] < slope < SIZE[1]:
        return float(slope)
    _, by_torque = _fitted(apart, one, torque, both_ways)
    (_, factor, *_), _ = _fitted(joint, one, angle, torque, both_ways)
    _, unlike_torque = _fitted(angle, one, torque, both_ways)
    wrong = abs(factor - 1.0) > 2 * TOLERANCE and unlike_torque > 0.5 * np.std(angle)
    return float(factor if wrong else slope) if wrong or by_angle < 0.5 * by_torque else None


def _fitted(signal: Array, *parts: Array) -> tuple[Array, float]:
    """Return the factors of ``parts`` (n,) each that fit a signal (n,) best, and the rms of what they leave."""
    columns = np.column_stack(parts)
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    factors = np.linalg.lstsq(columns / scale, signal, rcond=None)[0] / scale
    return factors, float(np.sqrt(np.mean((signal - columns @ factors) ** 2)))
