"""Rigid bodies of a model file and how they hang together, before a chain is made of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Motion = Literal["fixed", "revolute", "prismatic", "other"]


@dataclass(frozen=True, eq=False)
class Pose:
    """Rotation (3, 3) and origin (3,) [m] of a frame in another."""

    rotation: Array
    origin: Array

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose of a frame that ``other`` says in this one."""
        return Pose(self.rotation @ other.rotation, self.origin + self.rotation @ other.origin)

    def inverse(self) -> Pose:
        """Return the pose of the other frame in this one."""
        back = self.rotation.T
        return Pose(back, -back @ self.origin)


def still() -> Pose:
    """Return the pose of a frame in itself."""
    return Pose(np.eye(3), np.zeros(3))


@dataclass(frozen=True, eq=False)
class Mass:
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2], in one frame."""

    mass_kg: float
    com_m: Array
    inertia_kg_m2: Array

    def at(self, pose: Pose) -> Mass:
        """Return the same in the frame in which ``pose`` says this one."""
        rotation = pose.rotation
        return Mass(
            self.mass_kg,
            pose.origin + rotation @ self.com_m,
            rotation @ self.inertia_kg_m2 @ rotation.T,
        )


def joined(parts: Iterable[Mass]) -> Mass | None:
    """Return several masses of one frame as one body; None without any mass."""
    known = [part for part in parts if part.mass_kg > 0 or np.any(part.inertia_kg_m2)]
    if not known:
        return None
    if len(known) == 1:
        return known[0]
    mass = sum(part.mass_kg for part in known)
    com = sum((part.mass_kg * part.com_m for part in known), np.zeros(3)) / max(mass, 1e-300)
    inertia = np.zeros((3, 3))
    for part in known:
        off = part.com_m - com
        steiner = part.mass_kg * (off @ off * np.eye(3) - np.outer(off, off))
        inertia += part.inertia_kg_m2 + steiner
    return Mass(mass, com, inertia)


@dataclass(frozen=True)
class Drive:
    """What a file says of the drive of a joint, on the joint side unless said otherwise.

    ``gear_ratio`` r is joint angle per motor angle; ``rotor_inertia`` [kg m^2] as reflected to the joint,
    ``damping`` [Nm s/rad], ``friction`` [Nm], ``spring`` [Nm/rad] that pulls the joint to
    ``spring_rest_rad``; ``servo`` of an actuator that is told positions, its gains of position [Nm/rad] and
    speed [Nm s/rad], motor side; ``gain`` is a motor's torque per command, ``limit_nm`` the largest,
    ``delay_s`` and ``lag_s`` by which torque is late; ``effort`` [Nm] the limit of the joint, 0 where none is
    said; ``of_actuators`` is how much of rotor inertia and damping the file has on actuators; ``force_limits``
    [Nm] of its only actuator, before the gear, and of the joint, not a number where they are not alike both
    ways; ``speed_gain`` [Nm s/rad] of an actuator that is told speeds, motor side; ``sums_up``: an actuator
    of the joint has as its target the sum of what it is told.
    """

    gear_ratio: float = 1.0
    rotor_inertia: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    spring: float = 0.0
    spring_rest_rad: float = 0.0
    servo: tuple[float, float] | None = None
    gain: float = 1.0
    limit_nm: float = math.inf
    delay_s: float = 0.0
    lag_s: float = 0.0
    effort: float = 0.0
    of_actuators: tuple[float, float] = (0.0, 0.0)
    force_limits: tuple[float, float] = (math.inf, math.inf)
    speed_gain: float | None = None
    sums_up: bool = False


@dataclass(frozen=True)
class Steps:
    """The steps of a simulator whose file a model is: speeds it computes are those of the middle of steps.

    Forces act around the beginning of a step of ``step_s``, so that a target acts from half of it before.
    ``gains`` and ``damping`` say where speeds are taken that those of actuators and of joints act on: at
    the end of a step (1) or before it (-1). Half a step late, a damping is also an inertia.
    """

    step_s: float
    gains: int
    damping: int

    def added_inertia(self, gain_nm_s_rad: float, damping_nm_s_rad: float) -> float:
        """Return what both add to the inertia [kg m^2] of a motor, on whose side they are."""
        return 0.5 * self.step_s * (self.gains * gain_nm_s_rad + self.damping * damping_nm_s_rad)


@dataclass(frozen=True, eq=False)
class Body:
    """A body and the joint that moves it.

    ``pose``: its frame in the parent's with the joint at zero; ``axis`` (3,): of the joint, in its own
    frame; ``where``: its place in the file; ``refused``: why its joint cannot be one of a chain; ``of``: the
    body it moves, where that is another one; ``bare``: another joint of that body follows.
    """

    name: str
    parent: str | None
    joint: str
    motion: Motion
    pose: Pose
    axis: Array
    mass: Mass | None
    where: str
    drive: Drive = Drive()
    limits: tuple[float, float] | None = None
    refused: str = ""
    bare: bool = False
    of: str = ""


@dataclass
class Tree:
    """All bodies of a file by name, parents before children; ``notes``: what a chain cannot say of it.

    ``steps`` of the simulator whose file it is, where they show.
    """

    name: str
    bodies: dict[str, Body]
    file: str
    gravity_m_s2: Array | None = None
    notes: list[str] = field(default_factory=list)
    steps: Steps | None = None

    def children(self, name: str) -> list[Body]:
        """Return the bodies that hang on one."""
        return [body for body in self.bodies.values() if body.parent == name]

    def path(self, tip: str) -> list[Body]:
        """Return the bodies from the root to one, both included."""
        out = [self.bodies[tip]]
        while (parent := out[-1].parent) is not None:
            out.append(self.bodies[parent])
        return out[::-1]
