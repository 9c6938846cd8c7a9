"""Joints of a robot description as plain data."""

from __future__ import annotations

from collections.abc import Sequence
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

    The units are N/m and N s/m on a prismatic joint.
    """

    stiffness: float
    damping: float


@summarized
@dataclass(frozen=True, eq=False)
class Link:
    """The body that moves with a joint.

    ``mass_kg`` [kg]; centre of mass ``com_m`` (3,) [m] in the link frame; ``inertia_kg_m2`` (6,) [kg m^2]
    about the centre of mass, in link axes: xx, yy, zz, xy, xz, yz.
    """

    mass_kg: float
    com_m: Array
    inertia_kg_m2: Array


@summarized
@dataclass(frozen=True)
class Drive:
    """Motor and gear of a driven joint.

    ``gear_ratio`` is joint angle per motor angle [1, or m/rad on a prismatic joint]; ``motor_inertia``
    [kg m^2] and ``viscous_friction`` [Nm s/rad] are on the motor side.
    """

    gear_ratio: float
    motor_inertia: float
    viscous_friction: float


@summarized
@dataclass(frozen=True, eq=False)
class Joint:
    """A joint with its link, its spring and its drive.

    ``origin_m`` (3,) [m] and the unit vector ``axis`` (3,) are in the parent link's frame. ``spring`` is None
    for a rigid transmission, ``link`` is None for a massless link, ``drive`` is None for a joint without a
    motor. ``parent`` is the index, from 0, of the joint whose link carries this one, None on the base.
    """

    name: str
    parent: int | None
    prismatic: bool
    origin_m: Array
    axis: Array
    spring: Spring | None
    link: Link | None
    drive: Drive | None


def joint_of(entry: _core.JointEntry) -> Joint:
    """Return the joint of an entry from the compiled core."""
    spring, link, drive = entry["spring"], entry["link"], entry["drive"]
    return Joint(
        name=entry["name"],
        parent=entry["parent"],
        prismatic=entry["prismatic"],
        origin_m=np.array(entry["origin"]),
        axis=np.array(entry["axis"]),
        spring=None if spring is None else Spring(*spring),
        link=None if link is None else Link(link[0], np.array(link[1]), np.array(link[2])),
        drive=None if drive is None else Drive(*drive),
    )


def moved_by_axis(joints: Sequence[_core.JointEntry], driven: int) -> list[str]:
    """Return the names of a driven joint, by its index, and of elastic joints between it and the next axes."""
    own: set[int | None] = {driven}
    for i, joint in enumerate(joints):
        if joint["parent"] in own and joint["drive"] is None:
            own.add(i)
    return [joint["name"] for i, joint in enumerate(joints) if i in own]


def is_chain(joints: Sequence[_core.JointEntry]) -> bool:
    """Whether every joint is on the link of the joint before it, and the first one on the base."""
    return [joint["parent"] for joint in joints] == [None, *range(len(joints) - 1)]
