"""Where a parameter of a posterior stands in a rigid-body engine: the number of a joint, body or motor it changes.

Every number is affine in the parameters: an own parameter and a cause that changes it never vary in one hypothesis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from axisight.effects.stated import (
    DRY_FRICTION,
    JOINT_SPRING,
    LOAD,
    OTHER_GAINS,
    TORQUE_CONSTANT,
    TORQUE_LIMIT,
    TRANSPORT_DELAY,
)
from axisight.posterior.parameter import DrivenAxis, PosteriorParameter, Simulated
from axisight.posterior.result import Posterior

Kind = Literal[
    "armature",
    "damping",
    "frictionloss",
    "spring",
    "gear_stiffness",
    "gear_damping",
    "mass",
    "inertia",
    "kp",
    "kd",
    "torque",
    "force_limit",
    "own",
]
"""Kinds of numbers. ``own``: a parameter of the posterior that rigid-body engines have no number for."""

UNITS: Mapping[Kind, tuple[str, str]] = {
    "armature": ("kg m^2", "kg"),
    "damping": ("Nm s/rad", "N s/m"),
    "frictionloss": ("Nm", "N"),
    "spring": ("Nm/rad", "N/m"),
    "gear_stiffness": ("Nm/rad", "N/m"),
    "gear_damping": ("Nm s/rad", "N s/m"),
    "mass": ("1", "1"),
    "inertia": ("1", "1"),
    "kp": ("1", "1"),
    "kd": ("1", "1"),
    "torque": ("1", "1"),
    "force_limit": ("Nm", "N"),
    "own": ("1", "1"),
}
"""Units on the joint side: of a joint that turns, of one that slides. ``1``: a factor on the nominal value."""

# Quantity of the robot -> kind of number, and the power of the gear ratio by which the motor side is divided.
_ON_MOTOR: Mapping[str, tuple[Kind, int]] = {
    "motor_inertia": ("armature", 2),
    "viscous_friction": ("damping", 2),
}
_OF_GEAR: Mapping[str, Kind] = {"stiffness": "gear_stiffness", "damping": "gear_damping"}
_OF_BODY: Mapping[str, Kind] = {"mass": "mass", "inertia_scale": "inertia"}
_RIGID = (
    "the gears of such a model are rigid; elastic_gears=True (--elastic-gears) sets it in models with two joints an "
    "axis, as axisight.to_mujoco writes them"
)
_NOT_PD = "the gains of this controller are no gains of a servo with stiffness and damping"


@dataclass
class Number:
    """A number of an engine, on the joint side: ``constant`` plus the sum of coefficients times parameters.

    ``stated_unit``: unit of a number of the kind ``own``.
    """

    kind: Kind
    joint: str
    sliding: bool
    constant: float = 0.0
    terms: dict[str, float] = field(default_factory=dict)
    stated_unit: str = ""

    @property
    def unit(self) -> str:
        """Unit on the joint side; ``1`` for a factor."""
        return self.stated_unit or UNITS[self.kind][int(self.sliding)]


@dataclass
class _Homes:
    """Numbers found so far by kind and joint, and why the other parameters have none."""

    simulated: Simulated
    numbers: dict[tuple[Kind, str], Number] = field(default_factory=dict)
    homeless: dict[str, str] = field(default_factory=dict)

    def add(self, p: PosteriorParameter, number: Number, slope: float) -> None:
        """Add a parameter to a number; the constant is that of the first one."""
        known = self.numbers.setdefault((number.kind, number.joint), number)
        known.terms[p.name] = known.terms.get(p.name, 0.0) + slope


def homes(posterior: Posterior, *, elastic_gears: bool) -> tuple[list[Number], dict[str, str]]:
    """Return the numbers that the parameters change, and the reason for every parameter that changes none."""
    found = _Homes(posterior.simulated)
    own = {p.name for p in posterior.parameters if p.kind == "own"}
    for p in posterior.parameters:
        why = _placed(found, p, own, elastic_gears)
        if why:
            found.homeless[p.name] = why
    return list(found.numbers.values()), found.homeless


def _placed(found: _Homes, p: PosteriorParameter, own: set[str], elastic: bool) -> str:
    """Add one parameter to its number; return why there is none, else empty."""
    if p.effect is None:
        return _quantity(found, p, (p.name, "own"), own, elastic)
    if p.changes is not None:
        return _quantity(found, p, p.changes, own, elastic)
    axis = None if p.axis is None else found.simulated.axes[p.axis - 1]
    if axis is None:
        return _of_arm(p)
    return _effect(found, p, axis)


def _quantity(
    found: _Homes, p: PosteriorParameter, changes: tuple[str, str], own: set[str], elastic: bool
) -> str:
    """Add a parameter that is, or changes, a parameter of the robot."""
    name, how = changes
    joint, quantity = name.rsplit(".", 1)
    nominal = found.simulated.nominal.get(name, 0.0)
    slope = nominal if how == "relative" else 1.0
    # The nominal value stands in the constant if no own parameter carries it.
    constant = 0.0 if name in own else nominal
    if quantity in _ON_MOTOR:
        kind, power = _ON_MOTOR[quantity]
        axis = _axis_of(found.simulated, joint)
        scale = abs(axis.gear_ratio) ** -power
        number = Number(kind, joint, axis.sliding, scale * constant)
        found.add(p, number, scale * slope)
        return ""
    if quantity in _OF_GEAR:
        if not elastic:
            return _RIGID
        found.add(
            p, Number(_OF_GEAR[quantity], joint, _sliding(found.simulated, joint), constant), slope
        )
        return ""
    if quantity in _OF_BODY and nominal:
        number = Number(_OF_BODY[quantity], joint, False, constant / nominal)
        found.add(p, number, slope / nominal)
        return ""
    return "the frame of a link may differ from that of the engine's body; shift the centre of mass by hand"


def _effect(found: _Homes, p: PosteriorParameter, axis: DrivenAxis) -> str:
    """Add a parameter of a cause that changes no parameter of the robot."""
    ratio = abs(axis.gear_ratio)
    named = (p.effect, p.quantity)
    servo = found.simulated.controller == "pd_position"
    if named == DRY_FRICTION[:2]:
        found.add(p, Number("frictionloss", axis.joint, axis.sliding), 1 / ratio)
    elif named == JOINT_SPRING[:2]:
        found.add(p, Number("spring", axis.joint, axis.sliding), 1.0)
    elif named == TORQUE_LIMIT:
        found.add(p, Number("force_limit", axis.joint, axis.sliding), 1 / ratio)
    elif named == TORQUE_CONSTANT:
        found.add(p, Number("torque", axis.joint, axis.sliding, 1.0), 1.0)
    elif p.effect == OTHER_GAINS[0] and servo and p.quantity in OTHER_GAINS[1]:
        kind: Kind = "kp" if p.quantity == OTHER_GAINS[1][0] else "kd"
        found.add(p, Number(kind, axis.joint, axis.sliding, 1.0), 1.0)
    elif p.effect == OTHER_GAINS[0]:
        return _NOT_PD
    elif named == TRANSPORT_DELAY:
        return "delays are steps of an actuator model, not a number of the engine: set its least and largest delay"
    elif p.effect == DRY_FRICTION[0]:
        return "the engine smooths dry friction in its own way"
    else:
        return "the engine has no number for this law; axisight.mujoco.apply adds it in MuJoCo"
    return ""


def _of_arm(p: PosteriorParameter) -> str:
    if p.effect == LOAD:
        return "give the load a body of its own, and randomise its mass and position there"
    return "it belongs to the whole arm, and the engine has no number for it"


def _axis_of(simulated: Simulated, joint: str) -> DrivenAxis:
    return next(axis for axis in simulated.axes if axis.joint == joint)


def _sliding(simulated: Simulated, joint: str) -> bool:
    return any(axis.sliding for axis in simulated.axes if axis.joint == joint)
