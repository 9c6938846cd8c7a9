"""Where a USD joint states armature, damping, dry friction and a spring: attributes of three engines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Quantity = Literal["armature", "damping", "friction", "stiffness"]
QUANTITIES: tuple[Quantity, ...] = ("armature", "damping", "friction", "stiffness")


@dataclass(frozen=True)
class Home:
    """An attribute that states a quantity of a joint.

    ``name`` may contain ``{axis}``, which is ``angular`` or ``linear``. ``engine`` reads it. ``api`` is the
    schema that declares it. ``per_degree``: on joints that turn, its unit has degrees instead of radians.
    """

    engine: str
    name: str
    api: str
    per_degree: bool = False

    def attribute(self, *, turns: bool) -> str:
        """Return the name of the attribute on a joint that turns or slides."""
        return self.name.format(axis=axis_of(turns=turns))

    def schema(self, *, turns: bool) -> str:
        """Return the name of the schema on a joint that turns or slides."""
        return self.api.format(axis=axis_of(turns=turns))


def axis_of(*, turns: bool) -> str:
    """Return the instance name of the schemas of single axes."""
    return "angular" if turns else "linear"


_AXIS, _AXIS_API = "physxJointAxis:{axis}:", "PhysxJointAxisAPI:{axis}"
HOMES: Mapping[Quantity, tuple[Home, ...]] = {
    "armature": (
        Home("PhysX", _AXIS + "armature", _AXIS_API),
        Home("Newton", "newton:armature", "NewtonJointAPI"),
        Home("PhysX", "physxJoint:armature", "PhysxJointAPI"),
        Home("MuJoCo", "mjc:armature", "MjcJointAPI"),
    ),
    "damping": (
        Home("PhysX", _AXIS + "viscousFrictionCoefficient", _AXIS_API, per_degree=True),
        Home("Newton", "newton:damping", "NewtonJointAPI", per_degree=True),
        Home("MuJoCo", "mjc:damping", "MjcJointAPI"),
    ),
    "friction": (
        Home("PhysX", _AXIS + "dynamicFrictionEffort", _AXIS_API),
        Home("Newton", "newton:friction", "NewtonJointAPI"),
        Home("MuJoCo", "mjc:frictionloss", "MjcJointAPI"),
    ),
    "stiffness": (Home("MuJoCo", "mjc:stiffness", "MjcJointAPI"),),
}
"""Attributes by quantity. The import takes the first that a file states."""

SPRING_REST = "mjc:springref"
"""Angle [degree] or position at which a spring rests."""
STATIC_FRICTION = _AXIS + "staticFrictionEffort"
"""PhysX: effort up to which a joint at rest holds."""
CONSTRAINT_SPRING, CONSTRAINT_IMPEDANCE = "mjc:solreffriction", "mjc:solimpfriction"
"""Newton's solver MuJoCo: the soft constraint that dry friction is."""
DRIVE = "drive:{axis}:physics:"
"""Prefix of the attributes of a drive."""


@dataclass(frozen=True)
class Units:
    """The units of a stage: length [m], mass [kg], and the axis that points up."""

    length_m: float
    mass_kg: float
    up: str

    def inertia(self, *, turns: bool) -> float:
        """Return the unit of inertia, damping and stiffness of a joint [kg m^2, or kg], angles in radians."""
        return self.mass_kg * self.length_m**2 if turns else self.mass_kg

    def effort(self, *, turns: bool) -> float:
        """Return the unit of torque [Nm] or force [N] of a joint."""
        return self.mass_kg * self.length_m ** (2 if turns else 1)

    def of(self, quantity: Quantity, *, turns: bool, per_degree: bool) -> float:
        """Return the unit in which an attribute states a quantity, in SI units."""
        if quantity == "friction":
            return self.effort(turns=turns)
        unit = self.inertia(turns=turns)
        return math.degrees(unit) if per_degree and turns else unit


def stated(
    prim: Any, quantity: Quantity, units: Units, *, turns: bool
) -> Iterator[tuple[Home, float]]:
    """Yield the attributes of a joint that state a quantity, and their values in SI units, first that counts."""
    for home in HOMES[quantity]:
        value = authored(prim, home.attribute(turns=turns))
        if value is not None:
            yield home, float(value) * units.of(quantity, turns=turns, per_degree=home.per_degree)


def authored(prim: Any, name: str) -> Any:
    """Return the value of an attribute that a file states; None if it states none."""
    attribute = prim.GetAttribute(name)
    return attribute.Get() if attribute and attribute.HasAuthoredValue() else None
