"""A simulated machine: the robot, and everything in which it differs from its simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.robot import Robot

Array = NDArray[np.float64]
L = TypeVar("L")


@dataclass(frozen=True)
class Native:
    """Changes on one axis that an engine simulates itself.

    - ``half_width_rad``: half the play of the gear.
    - ``friction_nm``: dry friction of the motor.
    - ``armature``, ``spring``, ``damper``, ``viscous``: shares added to motor inertia, gear stiffness, gear
      damping and viscous friction of the motor.
    - ``gear``: share added to the actuator's torque; ``lag_s``: time constant of the actuator.
    - ``kp``, ``ki``: shares added to the controller's gains; ``filter_s``: time constant of its speed filter.
    - ``zero_rad``: joint angle at which the joint reads zero.
    - ``for_rate``, ``for_speed``: feedforward torque per rate of the reference [Nm s^2/rad] and per reference
      [Nm s/rad].
    - ``longer_m``: displacement of the next axis in the link.
    - ``turns_next``: share of its rotation that this axis adds to the gear of the next one.
    """

    half_width_rad: float = 0.0
    friction_nm: float = 0.0
    armature: float = 0.0
    spring: float = 0.0
    damper: float = 0.0
    viscous: float = 0.0
    gear: float = 0.0
    lag_s: float = 0.0
    kp: float = 0.0
    ki: float = 0.0
    filter_s: float = 0.0
    zero_rad: float = 0.0
    for_rate: float = 0.0
    for_speed: float = 0.0
    longer_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turns_next: float = 0.0


NOTHING = Native()


@dataclass(frozen=True)
class Ends:
    """Changes at both ends of the arm.

    - ``tip_kg`` at ``tip_m``: a load, in the frame of the last link.
    - ``rocks_rad_nm``: compliance of the base about x and y, rigid where zero.
    - ``rocks_s``: damping of the base over its stiffness.
    - ``tilted_rad``: rotation of the base about y, then about x.
    """

    tip_kg: float = 0.0
    tip_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rocks_rad_nm: tuple[float, float] = (0.0, 0.0)
    rocks_s: float = 0.0
    tilted_rad: tuple[float, float] = (0.0, 0.0)

    @property
    def springs(self) -> list[tuple[tuple[float, float, float], float]]:
        """Axis and stiffness [Nm/rad] of each spring of the base, from ground to arm."""
        named = zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), self.rocks_rad_nm, strict=True)
        return [(axis, 1 / c) for axis, c in named if c]


PLAIN = Ends()


@dataclass(frozen=True)
class Machine:
    """A robot with native changes and laws of its engine, by axis (from 0).

    ``fast``: by how much its clock is faster than that of the references [1].
    """

    robot: Robot
    native: Mapping[int, Native] = field(default_factory=dict)
    ends: Ends = PLAIN
    laws: Mapping[int, Sequence[object]] = field(default_factory=dict)
    fast: float = 0.0

    def met(self, reference: Array) -> Array:
        """Return the reference (n, n_axes) in the time of the machine's clock."""
        if not self.fast:
            return reference
        at = np.arange(len(reference), dtype=np.float64)
        wanted = np.minimum(at * (1 + self.fast), at[-1])
        return np.asarray(scipy.interpolate.CubicSpline(at, reference)(wanted))

    def gravity_m_s2(self) -> Array:
        """Return gravity (3,) [m/s^2] in the frame of the base."""
        about_x, about_y = self.ends.tilted_rad
        turned = scipy.spatial.transform.Rotation.from_euler("yx", [about_y, about_x])
        return np.asarray(turned.inv().apply(self.robot.gravity_m_s2))

    def along(self) -> Array:
        """Return the coupling (n_axes, n_axes) of motors to gears: each turns its own, some the next too."""
        ratio = np.asarray(self.robot.gear_ratio, np.float64)
        out = np.diag(ratio)
        for axis, own in enumerate(self.of_axes()[:-1]):
            out[axis + 1, axis] = own.turns_next * ratio[axis]
        return out

    def origins(self) -> list[tuple[float, ...]]:
        """Return the position of every joint in the link before it [m]."""
        own, axis, out = self.of_axes(), -1, []
        for joint in self.robot.joints:
            where = tuple(float(x) for x in joint.origin_m)
            if joint.drive is not None:
                if axis >= 0:
                    where = tuple(x + d for x, d in zip(where, own[axis].longer_m, strict=True))
                axis += 1
            out.append(where)
        return out

    def of_axes(self) -> list[Native]:
        """Return the native changes of every axis, in order."""
        return [self.native.get(axis, NOTHING) for axis in range(self.robot.n_axes)]

    def laws_of(self, kind: type[L]) -> list[tuple[int, L]]:
        """Return axis (from 0) and law of each law of a kind; raises InputError for another engine's law."""
        out = []
        for axis, laws in self.laws.items():
            for law in laws:
                if not isinstance(law, kind):
                    raise InputError(
                        f"law: expected a {kind.__name__} of this engine, got {type(law).__name__}"
                    )
                out.append((axis, law))
        return out
