"""Torques of effects at one moment, by the formulas of the compiled core."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import tomlkit
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.effects import Effect, core_effects, effect_info
from axisight.effects.stated import LEAD, WITH_MEMORY
from axisight.errors import InputError
from axisight.fitting import FitOptions, Weighting
from axisight.fitting.divergence import must_hold
from axisight.robot import Robot
from axisight.simulation import Integrator

Array = NDArray[np.float64]

_INSTEAD = {
    "transmission": "it acts inside the gear: give the model a joint that is its spring, and name it in gears",
    "sensor": "it changes what is measured: change what your controller reads",
    "controller": "it belongs to the controller: change your own",
    "arm": "it changes masses or lengths: write it into the model, write_back.write_model",
    "base": "it moves the base: turn gravity, or let the base give way, in the model",
}


def is_torque(effect: Effect) -> bool:
    """Return whether an effect is a torque that depends on angle, speed, load and command of one joint."""
    return not _why_none(effect)


def acts_in_gear(effect: Effect) -> bool:
    """Return whether an effect acts inside the gear of one axis."""
    info = effect_info(effect.name)
    return info.acts == "transmission" and info.scope == "axis"


def check_applicable(effects: Sequence[Effect], n_axes: int, elastic: Collection[int] = ()) -> None:
    """Raise InputError for the first effect that is no torque of angle, speed, load and command.

    ``n_axes``: number of axes. Axes in ``elastic`` (from 1) may have effects inside their gears. Also raises
    InputError for an axis above ``n_axes``.
    """
    for effect in effects:
        why = _why_none(effect)
        if why and not (acts_in_gear(effect) and effect.axis in elastic):
            raise InputError(
                f"effect {effect.label!r}: expected one that is a torque of the joint's angle, speed, load "
                f"and command, got one that is none: {why}"
            )
        if effect.axis is None or effect.axis > n_axes:
            raise InputError(
                f"effect {effect.label!r}: axis: expected one from 1 to {n_axes}, got {effect.axis}"
            )


def _why_none(effect: Effect) -> str:
    """Return why an effect is no such torque; empty if it is one."""
    info = effect_info(effect.name)
    if info.scope == "axes":
        return "it acts between two axes"
    if effect.name in WITH_MEMORY:
        return "it has a memory, and a torque of the moment has none"
    if (effect.parameters or {}).get(LEAD, 0.0) > 0:
        return "it acts ahead of the speed as MuJoCo's own: write it into the model, write_back.write_model"
    if (info.stands_for or ("",))[0] == "motor_inertia":
        return "it is an armature: write it into the model, write_back.write_model"
    return _INSTEAD.get(info.acts, "")


class EffectTorques:
    """Torques that effects add to joints, joint side, evaluated by the compiled core.

    The core evaluates effects of a whole robot. This class builds one from weightless wheels on a common
    axis: their joints take any torque at any speed, so that the difference to that torque is the effects'.
    """

    def __init__(self, effects: Sequence[Effect], gear_ratio: ArrayLike) -> None:
        self.ratio = np.asarray(gear_ratio, np.float64)
        self.n = len(self.ratio)
        self._robot = Robot.from_toml(_wheels(self.ratio))
        path = [e for e in effects if effect_info(e.name).acts == "torque_path"]
        self._path = core_effects(path)
        self._others = core_effects([e for e in effects if e not in path])
        self._weighting, self._options = Weighting.flat(self.n).core(), FitOptions()

    def __call__(self, angle: Array, speeds: Array, load: Array, command: Array) -> Array:
        """Return the torques (m, n_axes) [Nm] of all effects outside the command path.

        Arguments: ``angle`` [rad] and ``load`` [Nm] of the joints and ``command`` [Nm] of the motors, each
        (n_axes,), and ``speeds`` (m, n_axes) [rad/s] of the joints.
        """
        # Wheel k turns by the sum of all angles up to its own, and all joints up to it feel its torque.
        wheels = load - np.append(load[1:], 0.0)
        acceleration = np.diff(wheels, prepend=0.0)
        every = np.ones((len(speeds), 1))
        record = (
            every * (angle / self.ratio),
            np.ascontiguousarray(speeds / self.ratio),
            every * (acceleration / self.ratio),
            every * command,
            np.ones_like(speeds),
        )
        motion = _core.MeasuredMotions(self._robot.core, [record], self._weighting)
        found = motion.evaluate(self._others, [], self._options)
        # Motor torque under this load, minus what it takes without effects.
        asked = must_hold(found).residual.reshape(self.n, -1).T + command
        return np.asarray(load - asked / self.ratio)

    def of_command(self, command: Array) -> Array:
        """Return the torque that the command path adds to joints (n_axes,) [Nm]: delivered less commanded."""
        if not self._path:
            return np.zeros(self.n)
        step = self._robot.sample_time_s
        run = _core.simulate_batch(
            self._robot.core,
            self._path,
            np.tile(command, (1, 2, 1)),
            reference=False,
            integrator=Integrator("rk4"),
            threads=1,
        )
        # From rest a constant torque moves by half its acceleration times the time squared.
        moved = 2 * run["joint_position_rad"][0, 1] / step**2
        turned = np.cumsum(moved)
        delivered = np.cumsum(turned[::-1])[::-1]
        return np.asarray(delivered - command / self.ratio)


def _wheels(ratio: Array) -> str:
    """Return the robot file of wheels of 1 kg m^2 on one axis, each mounted on the one before."""
    joints = [
        {
            "name": f"wheel{i}",
            "kind": "driven",
            "origin": [0.0, 0.0, 0.0],
            "axis": [0.0, 0.0, 1.0],
            "link": {
                "mass": 1.0,
                "com": [0.0, 0.0, 0.0],
                "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            },
            "drive": {"gear_ratio": float(r), "motor_inertia": 0.0, "viscous_friction": 0.0},
        }
        for i, r in enumerate(ratio, 1)
    ]
    return tomlkit.dumps(
        {
            "schema": "axisight.robot/2",
            "name": "wheels",
            "gravity": [0.0, 0.0, 0.0],
            "sample_time": 1e-3,
            "joint": joints,
            "operating_point": {"joint_angle": [0.0] * len(ratio)},
        }
    )
