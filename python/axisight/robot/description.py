"""What a description says of a joint, as plain data, so that nobody else reads its text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.display.summary import summarized

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class Spring:
    """A gearbox or an elastic joint: stiffness [Nm/rad] and damping [Nm s/rad].

    N/m and N s/m if the joint slides.
    """

    stiffness: float
    damping: float


@summarized
@dataclass(frozen=True, eq=False)
class Link:
    """The body that moves with a joint.

    ``mass_kg``, centre of mass ``com_m`` (3,) in the link frame, and ``inertia_kg_m2`` (6,) about
    it, in link axes: xx, yy, zz, xy, xz, yz.
    """

    mass_kg: float
    com_m: Array
    inertia_kg_m2: Array


@summarized
@dataclass(frozen=True)
class Drive:
    """Motor and gear of a driven joint.

    ``gear_ratio`` is joint angle per motor angle [1, m/rad if it slides]; ``motor_inertia``
    [kg m^2] and ``viscous_friction`` [Nm s/rad] are on the motor side.
    """

    gear_ratio: float
    motor_inertia: float
    viscous_friction: float


@summarized
@dataclass(frozen=True, eq=False)
class Joint:
    """A joint of the chain and what it carries.

    ``origin_m`` (3,) and the unit vector ``axis`` (3,) stand in the parent link's frame.
    ``spring`` is None for a rigid transmission, ``link`` for a massless one, ``drive`` where no
    motor acts.
    """

    name: str
    prismatic: bool
    origin_m: Array
    axis: Array
    spring: Spring | None
    link: Link | None
    drive: Drive | None


def joint_of(entry: _core.JointEntry) -> Joint:
    """Return a joint as the compiled core tells it."""
    spring, link, drive = entry["spring"], entry["link"], entry["drive"]
    return Joint(
        name=entry["name"],
        prismatic=entry["prismatic"],
        origin_m=np.array(entry["origin"]),
        axis=np.array(entry["axis"]),
        spring=None if spring is None else Spring(*spring),
        link=None if link is None else Link(link[0], np.array(link[1]), np.array(link[2])),
        drive=None if drive is None else Drive(*drive),
    )
