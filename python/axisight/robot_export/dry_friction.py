"""Coulomb friction of a robot on the joint side, as other libraries need it."""

from __future__ import annotations

from axisight.effects.stated import DRY_FRICTION
from axisight.robot import Robot


def joint_friction_nm(robot: Robot) -> dict[str, float]:
    """Return the Coulomb friction [Nm or N], by name, of the joints that have this effect."""
    out = {}
    for effect in robot.effects:
        if effect.name == DRY_FRICTION[0] and effect.axis is not None:
            place = effect.axis - 1
            moment = (effect.parameters or {}).get(DRY_FRICTION[1], 0.0)
            out[robot.axis_names[place]] = moment / abs(float(robot.gear_ratio[place]))
    return out
