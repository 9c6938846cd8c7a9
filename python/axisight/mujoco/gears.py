"""Effects inside gears: torques on the joint that is a gear's spring, and the memory of gears."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import tomlkit
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import ConvergenceError, InputError
from axisight.robot import Robot

Array = NDArray[np.float64]

_MOST_PARTS = 4096
# Relative tolerance of the memory; torques are no more exact.
_TOLERANCE = 1e-6
# Numbers kept besides the effects' memory: whether it has begun, the time, and the angles of motor and
# spring.
_KEPT = 4


@dataclass(frozen=True)
class Gear:
    """A joint that is a gear's spring, with stiffness [Nm/rad] and damping [Nm s/rad].

    ``ratio``: joint angle per motor angle. The angle of the spring is the arm's minus the motor's.
    """

    effects: tuple[Effect, ...]
    ratio: float
    stiffness: float
    damping: float

    @cached_property
    def _robot(self) -> _core.Robot:
        return Robot.from_toml(_wheel(self.ratio, self.stiffness, self.damping)).core

    @cached_property
    def _effects(self) -> list[tuple[str, int | tuple[int, int] | None, list[float]]]:
        return core_effects([replace(effect, axis=1) for effect in self.effects])

    @cached_property
    def n_remembered(self) -> int:
        """Number of states that the effects remember."""
        return len(_core.state_at_rest(self._robot, self._effects, [0.0])) - 4

    @property
    def n_kept(self) -> int:
        """Number of values kept between calls."""
        return self.n_remembered + _KEPT if self.n_remembered else 0

    def torques(self, place: Array, speed: Array, remembered: Array) -> Array:
        """Return the torques that effects add on motor joint and spring (2,) [Nm], joint side.

        ``place`` and ``speed`` are those of motor joint and spring (2,) [rad], [rad/s].
        """
        _, _, motor, arm = self._rates(place, speed, remembered)[:4]
        # Both wheels have an inertia of 1. Torque on the motor moves the arm too.
        spring = self.stiffness * place[1] + self.damping * speed[1]
        return np.array([arm + motor / self.ratio, arm + spring])

    def remember(self, kept: Array, time: float, place: Array) -> Array:
        """Advance ``kept`` (n_kept,) to the present in place, and return the effects' memory.

        Assumes constant speeds of motor and spring since the last call. Raises InputError if time went back,
        ConvergenceError if the step is too long for the gear.
        """
        begun, then, *_ = kept
        if begun and time < then:
            raise InputError(
                f"data.time: expected it to go on from {then:g} s, got {time:g} s: after mj_resetData gears "
                f"begin anew, or where data.userdata is put back with the rest"
            )
        if not begun:
            kept[_KEPT:] = 0.0
        elif time > then:
            kept[_KEPT:] = self._led_on(kept[_KEPT:], kept[2:_KEPT], place, time - then)
        kept[:_KEPT] = 1.0, time, *place
        return kept[_KEPT:]

    def _led_on(self, remembered: Array, before: Array, after: Array, time: float) -> Array:
        """Return the memory after a motion at constant speed, in as many parts as accuracy needs."""
        parts = 1
        coarse = self._in_parts(remembered, before, after, time, parts)
        while parts < _MOST_PARTS:
            parts *= 2
            fine = self._in_parts(remembered, before, after, time, parts)
            if np.abs(fine - coarse).max() <= _TOLERANCE:
                return fine
            coarse = fine
        raise ConvergenceError(
            f"effects: expected a gear that a step of {time:g} s can follow, moved by {after - before} rad: "
            f"take a shorter timestep"
        )

    def _in_parts(
        self, remembered: Array, before: Array, after: Array, time: float, parts: int
    ) -> Array:
        """Integrate by the classical Runge-Kutta method."""
        speed, step, z = (after - before) / time, time / parts, remembered

        def rates(at: float, z: Array) -> Array:
            return self._rates(before + speed * at, speed, z)[4:]

        for k in range(parts):
            a = rates(k * step, z)
            b = rates((k + 0.5) * step, z + 0.5 * step * a)
            c = rates((k + 0.5) * step, z + 0.5 * step * b)
            d = rates((k + 1.0) * step, z + step * c)
            z = z + step / 6 * (a + 2 * b + 2 * c + d)
        return z

    def _rates(self, place: Array, speed: Array, remembered: Array) -> Array:
        (motor, spring), (motor_speed, spring_speed) = place.tolist(), speed.tolist()
        ratio = self.ratio
        state = [motor / ratio, motor + spring, motor_speed / ratio, motor_speed + spring_speed]
        row = np.array([[*state, *remembered.tolist()]])
        return np.asarray(_core.state_rates(self._robot, self._effects, row, [0.0])[0])


def _wheel(ratio: float, stiffness: float, damping: float) -> str:
    """Return the robot file of a wheel of 1 kg m^2 behind a gear, and a motor of the same inertia."""
    joint = {
        "name": "wheel",
        "kind": "driven",
        "origin": [0.0, 0.0, 0.0],
        "axis": [0.0, 0.0, 1.0],
        "stiffness": stiffness,
        "damping": damping,
        "link": {"mass": 1.0, "com": [0.0, 0.0, 0.0], "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]},
        "drive": {"gear_ratio": ratio, "motor_inertia": 1.0, "viscous_friction": 0.0},
    }
    return tomlkit.dumps(
        {
            "schema": "axisight.robot/2",
            "name": "wheel",
            "gravity": [0.0, 0.0, 0.0],
            "sample_time": 1e-3,
            "joint": [joint],
            "operating_point": {"joint_angle": [0.0]},
        }
    )
