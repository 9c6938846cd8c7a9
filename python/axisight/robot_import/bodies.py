"""The tree of rigid bodies in a model file, from which `chain` takes a chain or branches."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.effects.dcmotor import Device
from axisight.robot import JointLimits

Array = NDArray[np.float64]
Motion = Literal["fixed", "revolute", "prismatic", "other"]


@dataclass(frozen=True, eq=False)
class Pose:
    """Rotation (3, 3) and origin (3,) [m] of a frame in another."""

    rotation: Array
    origin: Array

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose, in the outer frame, of a frame whose pose in this frame is ``other``."""
        return Pose(self.rotation @ other.rotation, self.origin + self.rotation @ other.origin)

    def inverse(self) -> Pose:
        """Return the pose of the outer frame in this frame."""
        back = self.rotation.T
        return Pose(back, -back @ self.origin)


def still() -> Pose:
    """Return the identity pose."""
    return Pose(np.eye(3), np.zeros(3))


@dataclass(frozen=True, eq=False)
class Mass:
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2], in one frame."""

    mass_kg: float
    com_m: Array
    inertia_kg_m2: Array

    def at(self, pose: Pose) -> Mass:
        """Return the same mass in the outer frame, in which ``pose`` is the pose of this frame."""
        rotation = pose.rotation
        return Mass(
            self.mass_kg,
            pose.origin + rotation @ self.com_m,
            rotation @ self.inertia_kg_m2 @ rotation.T,
        )


def joined(parts: Iterable[Mass]) -> Mass | None:
    """Return several masses in the same frame as one body; None if there is no mass."""
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


def mimics(master: str) -> str:
    """Return why a chain cannot have a joint that follows the joint ``master``."""
    return (
        f"expected joints with drives of their own between base and tip, got one that mimics {master!r}: cut it "
        f"by --tip, it is then locked at zero"
    )


@dataclass(frozen=True)
class Drive:
    """The drive of a joint as the model file states it, joint-side unless noted.

    - ``gear_ratio`` r: joint angle per motor angle [1, or m/rad]
    - ``rotor_inertia``: inertia of the rotor reflected to the joint [kg m^2]
    - ``damping`` [Nm s/rad], ``friction``: dry friction [Nm]
    - ``friction_corner_rad_s``: speed over which dry friction changes sign; ``friction_lead_s``: by how much it
      acts ahead of the speed
    - ``spring`` [Nm/rad]: a spring that pulls the joint to ``spring_rest_rad`` [rad]
    - ``servo``: gains on position [Nm/rad] and speed [Nm s/rad] of an actuator with position targets,
      motor-side
    - ``gain``: torque of the motor per command; ``limit_nm``: largest motor torque [Nm]
    - ``delay_s``, ``lag_s``: delay and first-order lag of the torque [s]
    - ``effort``: torque limit of the joint [Nm], 0 if the file states none
    - ``drag`` [Nm s^2/rad^2]: damping in proportion to the squared speed
    - ``of_actuators``: the parts of rotor inertia, damping and drag that the file states on actuators
    - ``damping_beyond``, ``spring_beyond``: quadratic and cubic coefficients of the joint's own damping and spring
    - ``devices``: cogging and bristles of actuators
    - ``offset_nm``: constant torque of the motor [Nm], motor-side; ``reading_delay_s``: delay of its encoder [s]
    - ``force_limits``: limits [Nm] of the only actuator, before the gear, and of the joint; NaN if a limit is
      not the same in both directions
    - ``speed_gain`` [Nm s/rad]: gain of an actuator with speed targets, motor-side
    - ``sums_up``: an actuator of the joint integrates its commands to its target
    """

    gear_ratio: float = 1.0
    rotor_inertia: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    friction_corner_rad_s: float = 0.01
    friction_lead_s: float = 0.0
    spring: float = 0.0
    spring_rest_rad: float = 0.0
    servo: tuple[float, float] | None = None
    gain: float = 1.0
    limit_nm: float = math.inf
    delay_s: float = 0.0
    lag_s: float = 0.0
    effort: float = 0.0
    drag: float = 0.0
    of_actuators: tuple[float, float, float] = (0.0, 0.0, 0.0)
    damping_beyond: tuple[float, float] = (0.0, 0.0)
    spring_beyond: tuple[float, float] = (0.0, 0.0)
    devices: tuple[Device, ...] = ()
    offset_nm: float = 0.0
    reading_delay_s: float = 0.0
    force_limits: tuple[float, float] = (math.inf, math.inf)
    speed_gain: float | None = None
    sums_up: bool = False


@dataclass(frozen=True)
class Steps:
    """The time steps of the simulator of a model file, which change how its actuators act.

    The simulator computes speeds for the middle of a step, and forces act around its start. So a target acts
    from half a step earlier; ``step_s`` is the step [s]. ``gains`` is 1 if the speed gains of actuators act
    on the speed at the end of a step, and -1 if they act on the speed before it. ``damping`` is the same for
    the damping of joints. A damping that acts half a step off is also an inertia.
    """

    step_s: float
    gains: int
    damping: int

    def added_inertia(self, gain_nm_s_rad: float, damping_nm_s_rad: float) -> float:
        """Return the inertia [kg m^2] that a speed gain and a damping add, on the side on which they act."""
        return 0.5 * self.step_s * (self.gains * gain_nm_s_rad + self.damping * damping_nm_s_rad)


@dataclass(frozen=True, eq=False)
class Body:
    """A body and the joint that moves it.

    ``pose`` is the frame of the body in that of its parent, with the joint at zero. ``axis`` (3,) is the
    joint axis in the frame of the body. ``where`` is the place in the file, for messages. ``refused`` says
    why a chain cannot have its joint. If the body only stands for a joint, ``of`` is the body in the file
    that the joint moves. ``bare`` means that another joint of that body follows. ``follows`` is the name of a
    joint that this joint follows. ``is_free``: the joint lets the body move in all six directions.
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
    limits: JointLimits = field(default_factory=JointLimits)
    refused: str = ""
    bare: bool = False
    of: str = ""
    follows: str = ""
    is_free: bool = False


@dataclass
class Tree:
    """All bodies of a file by name, parents before children.

    ``notes`` lists what a chain cannot state. ``steps`` are the time steps of the simulator of the file, None
    if they have no visible effect. ``gravity_m_s2`` (3,) [m/s^2] is None if the file states none.
    ``gravity_share``: share of it that acts. ``holds_weight``: actuators compensate the weight.
    """

    name: str
    bodies: dict[str, Body]
    file: str
    gravity_m_s2: Array | None = None
    notes: list[str] = field(default_factory=list)
    steps: Steps | None = None
    gravity_share: float = 1.0
    holds_weight: bool = False

    def children(self, name: str) -> list[Body]:
        """Return the bodies whose parent is ``name``."""
        return [body for body in self.bodies.values() if body.parent == name]

    def path(self, tip: str) -> list[Body]:
        """Return the bodies from the root to ``tip``, both included."""
        out = [self.bodies[tip]]
        while (parent := out[-1].parent) is not None:
            out.append(self.bodies[parent])
        return out[::-1]
