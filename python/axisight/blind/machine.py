"""A machine as it really is: the robot, and what differs from its simulator; engines make it move."""

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
    """What an engine changes by itself on one axis.

    ``half_width_rad``: the gear is slack within; ``friction_nm``: dry friction of the motor;
    ``armature``: share of motor inertia added; ``spring``, ``damper``: shares added
    to gear stiffness and damping; ``viscous``: share added to viscous friction of the motor;
    ``gear``: share added to the torque of the actuator; ``lag_s``: its time constant; ``kp``, ``ki``: shares
    added to the gains of the controller, ``filter_s`` the time constant of a filter on its speed;
    ``zero_rad``: angle of the joint where it counts zero; ``for_rate``, ``for_speed``: torque fed forward
    for the rate of the reference [Nm s^2/rad] and for the reference [Nm s/rad]; ``longer_m``: by how much
    the next axis lies elsewhere in the link; ``turns_next``: share of its turn by which it turns the gear
    of the next axis along.
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
    """What differs at both ends of the arm.

    ``tip_kg`` at ``tip_m`` in the frame of the last link; ``rocks_rad_nm``: compliance of the base about
    x and y, none where it is zero, ``rocks_s`` their damping over stiffness; ``tilted_rad``: by how much the
    base is turned about its y, then about its x.
    """

    tip_kg: float = 0.0
    tip_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rocks_rad_nm: tuple[float, float] = (0.0, 0.0)
    rocks_s: float = 0.0
    tilted_rad: tuple[float, float] = (0.0, 0.0)

    @property
    def springs(self) -> list[tuple[tuple[float, float, float], float]]:
        """Axis and stiffness of each spring of the base, ground to arm."""
        named = zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), self.rocks_rad_nm, strict=True)
        return [(axis, 1 / c) for axis, c in named if c]


PLAIN = Ends()


@dataclass(frozen=True)
class Machine:
    """A robot as it really is: native changes and laws of its engine by axis (from 0).

    ``fast``: by how much its clock is fast against that of the references [1].
    """

    robot: Robot
    native: Mapping[int, Native] = field(default_factory=dict)
    ends: Ends = PLAIN
    laws: Mapping[int, Sequence[object]] = field(default_factory=dict)
    fast: float = 0.0

    def met(self, reference: Array) -> Array:
        """Return the reference (n, n_axes) as the machine's own clock meets it."""
        if not self.fast:
            return reference
        at = np.arange(len(reference), dtype=np.float64)
        wanted = np.minimum(at * (1 + self.fast), at[-1])
        return np.asarray(scipy.interpolate.CubicSpline(at, reference)(wanted))

    def gravity_m_s2(self) -> Array:
        """Return gravity (3,) as the base feels it."""
        about_x, about_y = self.ends.tilted_rad
        turned = scipy.spatial.transform.Rotation.from_euler("yx", [about_y, about_x])
        return np.asarray(turned.inv().apply(self.robot.gravity_m_s2))

    def along(self) -> Array:
        """Return by how much each motor's turn turns the joints' gears (n_axes, n_axes): its own and the next."""
        ratio = np.asarray(self.robot.gear_ratio, np.float64)
        out = np.diag(ratio)
        for axis, own in enumerate(self.of_axes()[:-1]):
            out[axis + 1, axis] = own.turns_next * ratio[axis]
        return out

    def origins(self) -> list[tuple[float, ...]]:
        """Return where every joint lies in the link before [m]."""
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
        """Return the native changes of every axis."""
        return [self.native.get(axis, NOTHING) for axis in range(self.robot.n_axes)]

    def laws_of(self, kind: type[L]) -> list[tuple[int, L]]:
        """Return axis (from 0) and law, all of a kind. Raises InputError for laws of another engine."""
        out = []
        for axis, laws in self.laws.items():
            for law in laws:
                if not isinstance(law, kind):
                    raise InputError(
                        f"law: expected a {kind.__name__} of this engine, got {type(law).__name__}"
                    )
                out.append((axis, law))
        return out
