"""What kinds of effects are drawn for: an arm and its motions, in units that fit its motors and gears."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from axisight.blind.machine import NOTHING, PLAIN, Ends, Native
from axisight.robot import Robot
from axisight.simulation import simulate

Array = NDArray[np.float64]
Rng = np.random.Generator

# Axis 1 of the preset, for which ranges are stated: motor inertia [kg m^2], the deflection [rad] that
# 20 Nm of its motor cause, reach [m] and mass [kg] of the arm.
_MOTOR_INERTIA = 0.0121
_RATED_NM = 20.0
_DEFLECTION_RAD = 2.56e-3
_REACH_M = 2.75
_MASS_KG = 1440.0
# Of the rated torque of a motor: less is no weight.
_NO_WEIGHT = 0.01


@dataclass(frozen=True)
class Scene:
    """An arm (the simulator of its cases) and the references (n, n_axes) [rad/s] it will follow."""

    robot: Robot
    references: Sequence[Array]

    def of_joint(self, axis: int, quantity: str) -> float:
        """Return a parameter of the joint of an axis (from 1)."""
        return self.robot.parameters()[f"{self.robot.axis_names[axis - 1]}.{quantity}"]

    def stiffness(self, axis: int) -> float:
        """Return the stiffness of the gear of an axis [Nm/rad]."""
        return self.of_joint(axis, "stiffness")

    def torque(self, axis: int) -> float:
        """Return the unit of motor torques of an axis: 1 is axis 1 of the preset."""
        return self.of_joint(axis, "motor_inertia") / _MOTOR_INERTIA

    def deflection(self, axis: int) -> float:
        """Return the unit of gear deflections of an axis: 1 is axis 1 of the preset."""
        ratio = float(self.robot.gear_ratio[axis - 1])
        rated = _RATED_NM * self.torque(axis) / ratio
        return rated / self.stiffness(axis) / _DEFLECTION_RAD

    def play(self, axis: int) -> float:
        """Return the unit of lost motion and of errors of gears: 1 on axes that turn."""
        return self.deflection(axis) if self.robot.axis_is_prismatic[axis - 1] else 1.0

    def rated_nm(self, axis: int) -> float:
        """Return the rated torque of a motor, on its joint [Nm]."""
        return _RATED_NM * self.torque(axis) / abs(float(self.robot.gear_ratio[axis - 1]))

    def speed(self, axis: int) -> float:
        """Return the largest speed of a motor that its references ask for [rad/s]."""
        return max(float(np.abs(x[:, axis - 1]).max()) for x in self.references)

    def travel(self, axis: int) -> float:
        """Return how far a joint moves along the references that move it most [rad, m]."""
        step_s = self.robot.sample_time_s
        ways = (np.ptp(np.cumsum(x[:, axis - 1])) * step_s for x in self.references)
        return float(max(ways)) * abs(float(self.robot.gear_ratio[axis - 1]))

    def holds(self, axis: int) -> float:
        """Return the torque that holds an axis at rest, over the rated one of its motor."""
        return self.at_rest_nm(axis) / (_RATED_NM * self.torque(axis))

    def at_rest_nm(self, axis: int) -> float:
        """Return the size of the motor torque that holds an axis at rest [Nm]."""
        return float(np.abs(self._at_rest[axis - 1]))

    @cached_property
    def _at_rest(self) -> Array:
        still = np.zeros((1, self.robot.n_axes))
        return np.asarray(simulate(self.robot, still)["torque_cmd_nm"].values[0])

    @property
    def reach(self) -> float:
        """Return the unit of lengths: 1 is the preset."""
        links = [j.link for j in self.robot.joints if j.link is not None]
        total = sum(float(np.linalg.norm(j.origin_m)) for j in self.robot.joints)
        return (total + float(np.linalg.norm(links[-1].com_m))) / _REACH_M

    @property
    def last_kg(self) -> float:
        """Return the mass of the last link."""
        return next(j.link for j in reversed(self.robot.joints) if j.link is not None).mass_kg

    @property
    def weight(self) -> float:
        """Return the unit of moments of inertia of the arm: 1 is the preset."""
        total = sum(j.link.mass_kg for j in self.robot.joints if j.link is not None)
        return total / _MASS_KG * self.reach**2

    @cached_property
    def largest_nm(self) -> Array:
        """The largest torque (n_axes,) that the simulator commands along the references."""
        torques = (simulate(self.robot, x)["torque_cmd_nm"].values for x in self.references)
        return np.asarray(np.max([np.abs(x).max(axis=0) for x in torques], axis=0))


@dataclass(frozen=True)
class Drawn:
    """One effect as drawn: parameters as the library states them, and what makes it.

    ``axis`` from 1; None for the arm, which ``ends`` is of. ``laws`` of the engine; ``changed``:
    parameters of the robot; ``fast``: of the machine's clock, as `Machine` has it.
    """

    effect: str
    axis: int | None
    parameters: Mapping[str, float]
    native: Native = NOTHING
    laws: Sequence[object] = field(default_factory=tuple)
    ends: Ends = PLAIN
    changed: Mapping[str, float] = field(default_factory=dict)
    fast: float = 0.0


Draw = Callable[[Rng, Scene, int], Drawn]


def everywhere(scene: Scene) -> list[int]:
    """Return all axes (from 1)."""
    return scene.robot.axis_numbers()


def turning(scene: Scene) -> list[int]:
    """Return the axes that turn: the zero of a slide moves no weight about."""
    slides = scene.robot.axis_is_prismatic
    return [axis for axis in everywhere(scene) if not slides[axis - 1]]


def unloaded(scene: Scene) -> list[int]:
    """Return the axes that carry no weight.

    Where a torque keeps its sign, a deadband is an offset and a gear stays beyond its knee.
    """
    return [axis for axis in everywhere(scene) if scene.holds(axis) < _NO_WEIGHT]


@dataclass(frozen=True)
class Kind:
    """A kind of effect, and the axes where it is one. ``in_library``: the diagnosis can name it.

    ``alone``: no other effect is drawn beside it, whose law would not know of it.
    """

    draw: Draw
    in_library: bool = True
    axes: Callable[[Scene], list[int]] = everywhere
    alone: bool = False


def sign(rng: Rng) -> float:
    """Draw a sign."""
    return float(rng.choice([-1.0, 1.0]))


def between(rng: Rng, low: float, high: float) -> float:
    """Draw evenly by factors."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
