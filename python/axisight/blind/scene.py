"""The arm and motions for which effects are drawn, with units that scale with its motors and gears."""

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

# Axis 1 of the preset, for which all ranges are stated: motor inertia [kg m^2], gear deflection [rad] under
# 20 Nm of motor torque, reach [m] and mass [kg] of the arm.
_MOTOR_INERTIA = 0.0121
_RATED_NM = 20.0
_DEFLECTION_RAD = 2.56e-3
_REACH_M = 2.75
_MASS_KG = 1440.0
# Share of a motor's rated torque below which an axis counts as unloaded.
_NO_WEIGHT = 0.01


@dataclass(frozen=True)
class Scene:
    """An arm (the simulator of its cases) and the references (n, n_axes) [rad/s] that it will follow."""

    robot: Robot
    references: Sequence[Array]

    def of_joint(self, axis: int, quantity: str) -> float:
        """Return a parameter of the joint of an axis (from 1)."""
        return self.robot.parameters()[f"{self.robot.axis_names[axis - 1]}.{quantity}"]

    def stiffness(self, axis: int) -> float:
        """Return the stiffness of the gear of an axis [Nm/rad]."""
        return self.of_joint(axis, "stiffness")

    def torque(self, axis: int) -> float:
        """Return the scale of motor torques of an axis, relative to axis 1 of the preset."""
        return self.of_joint(axis, "motor_inertia") / _MOTOR_INERTIA

    def deflection(self, axis: int) -> float:
        """Return the scale of gear deflections of an axis, relative to axis 1 of the preset."""
        ratio = float(self.robot.gear_ratio[axis - 1])
        rated = _RATED_NM * self.torque(axis) / ratio
        return rated / self.stiffness(axis) / _DEFLECTION_RAD

    def play(self, axis: int) -> float:
        """Return the scale of lost motion and gear errors: 1 on revolute axes."""
        return self.deflection(axis) if self.robot.axis_is_prismatic[axis - 1] else 1.0

    def rated_nm(self, axis: int) -> float:
        """Return the rated torque of a motor, joint side [Nm]."""
        return _RATED_NM * self.torque(axis) / abs(float(self.robot.gear_ratio[axis - 1]))

    def speed(self, axis: int) -> float:
        """Return the largest motor speed in the references [rad/s]."""
        return max(float(np.abs(x[:, axis - 1]).max()) for x in self.references)

    def travel(self, axis: int) -> float:
        """Return the travel of a joint in the reference that moves it most [rad, m]."""
        step_s = self.robot.sample_time_s
        ways = (np.ptp(np.cumsum(x[:, axis - 1])) * step_s for x in self.references)
        return float(max(ways)) * abs(float(self.robot.gear_ratio[axis - 1]))

    def holds(self, axis: int) -> float:
        """Return the torque that holds an axis at rest, over its motor's rated torque [1]."""
        return self.at_rest_nm(axis) / (_RATED_NM * self.torque(axis))

    def at_rest_nm(self, axis: int) -> float:
        """Return the magnitude of the motor torque that holds an axis at rest [Nm]."""
        return float(np.abs(self._at_rest[axis - 1]))

    @cached_property
    def _at_rest(self) -> Array:
        still = np.zeros((1, self.robot.n_axes))
        return np.asarray(simulate(self.robot, still)["torque_cmd_nm"].values[0])

    @property
    def reach(self) -> float:
        """Return the scale of lengths, relative to the preset."""
        links = [j.link for j in self.robot.joints if j.link is not None]
        total = sum(float(np.linalg.norm(j.origin_m)) for j in self.robot.joints)
        return (total + float(np.linalg.norm(links[-1].com_m))) / _REACH_M

    @property
    def last_kg(self) -> float:
        """Return the mass of the last link [kg]."""
        return next(j.link for j in reversed(self.robot.joints) if j.link is not None).mass_kg

    @property
    def weight(self) -> float:
        """Return the scale of the arm's moments of inertia, relative to the preset."""
        total = sum(j.link.mass_kg for j in self.robot.joints if j.link is not None)
        return total / _MASS_KG * self.reach**2

    @cached_property
    def largest_nm(self) -> Array:
        """Largest torques (n_axes,) [Nm] that the simulator commands along the references."""
        torques = (simulate(self.robot, x)["torque_cmd_nm"].values for x in self.references)
        return np.asarray(np.max([np.abs(x).max(axis=0) for x in torques], axis=0))


@dataclass(frozen=True)
class Drawn:
    """One drawn effect: its parameters in the library's terms, and how the engine makes it.

    - ``axis``: from 1; None for effects of the whole arm (``ends``, ``fast``).
    - ``laws``: laws of the engine.
    - ``changed``: changed parameters of the robot.
    - ``ends``, ``fast``: as in `Machine`.
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
    """Return the revolute axes: a shifted zero of a prismatic one turns no weight."""
    slides = scene.robot.axis_is_prismatic
    return [axis for axis in everywhere(scene) if not slides[axis - 1]]


def unloaded(scene: Scene) -> list[int]:
    """Return the axes that carry no weight.

    On a loaded axis the torque keeps its sign: a deadband then looks like an offset, and a gear stays beyond
    its knee.
    """
    return [axis for axis in everywhere(scene) if scene.holds(axis) < _NO_WEIGHT]


@dataclass(frozen=True)
class Kind:
    """A kind of effect, and the axes on which it shows. ``in_library``: the diagnosis can name it.

    ``alone``: no second effect is drawn with it, because its law would ignore that one.
    """

    draw: Draw
    in_library: bool = True
    axes: Callable[[Scene], list[int]] = everywhere
    alone: bool = False


def sign(rng: Rng) -> float:
    """Draw a sign."""
    return float(rng.choice([-1.0, 1.0]))


def between(rng: Rng, low: float, high: float) -> float:
    """Draw from a log-uniform distribution."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
