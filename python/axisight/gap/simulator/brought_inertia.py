"""Inertia that a named effect brings with it, and that own parameters of the simulator take over in a fit.

A load is fitted by its mass and its place. Its inertia about itself is not: few logs tell it from the rest. So the
rotors and links that turn with the load take it over, and seem to be wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from axisight.effects import Effect, effect_info
from axisight.effects.stated import OWN_INERTIA
from axisight.robot import Robot
from axisight.robot.description import Joint


@dataclass(frozen=True)
class BroughtInertia:
    """What an own parameter takes over from a body: ``effect`` that brings it, driven ``axis`` (from 1) that turns it.

    ``unit_kg_m2``: inertia about that axis per unit of the parameter, joint side. ``mass_kg`` of the body;
    ``usual_m2``: squared radius of gyration that such bodies usually have.
    """

    effect: str
    axis: int
    unit_kg_m2: float
    mass_kg: float
    usual_m2: float

    def of(self, change: float) -> float | None:
        """Return the inertia [kg m^2] that a change of the parameter stands for; None if such a body has less."""
        inertia = change * self.unit_kg_m2
        return inertia if 0.0 < inertia / self.mass_kg <= self.usual_m2 else None


def brought_inertias(robot: Robot, effects: Sequence[Effect]) -> dict[str, BroughtInertia]:
    """Return, by own parameter, what it takes over from the bodies that ``effects`` bring without their inertia."""
    out: dict[str, BroughtInertia] = {}
    for effect in effects:
        values = effect.parameters or {}
        for name, mass, radius in OWN_INERTIA:
            mass_kg = values.get(mass, 0.0)
            if effect.name == name and mass_kg and not values.get(radius):
                usual = next(p.typical for p in effect_info(name).parameters if p.name == radius)
                out |= _turning(robot, effect.label, mass_kg, usual)
    return out


def _turning(
    robot: Robot, label: str, mass_kg: float, usual_m2: float
) -> dict[str, BroughtInertia]:
    """Return the rotors and links that turn with a body on the last link that has mass.

    Its inertia about itself is taken as the same about all axes.
    """
    joints = list(robot.joints)
    while joints and joints[-1].link is None:
        joints.pop()
    out, axis = {}, 0
    for joint in joints:
        axis += joint.drive is not None
        if not axis or joint.prismatic:
            continue
        units = {f"{joint.name}.inertia_scale": _about(joint)}
        if joint.drive is not None:
            units[f"{joint.name}.motor_inertia"] = float(robot.gear_ratio[axis - 1]) ** -2
        for name, unit in units.items():
            out[name] = BroughtInertia(label, axis, unit, mass_kg, usual_m2)
    return out


def _about(joint: Joint) -> float:
    """Return the inertia of a joint's link about its axis [kg m^2]; zero without a link."""
    if joint.link is None:
        return 0.0
    xx, yy, zz, xy, xz, yz = joint.link.inertia_kg_m2
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return float(joint.axis @ inertia @ joint.axis)
