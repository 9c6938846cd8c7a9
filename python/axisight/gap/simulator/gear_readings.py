"""Deflections of gears that encoders on motor and joint show, beside those of the simulator's gears.

A reading is half the distance between the deflections under torque one way and the other, at a weak and at a strong
torque. The simulator's reading is that of its gear at rest under the same torques: a law of the gear, without a motion
that could take another course than the machine's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects, effect_info
from axisight.gap.signals.both_encoders import bends_along, bends_of, joint_torque, stiffnesses
from axisight.gap.signals.lowpass_cutoff import highest_cutoff_hz
from axisight.gap.signals.noise import white_std
from axisight.logs import Log, differentiate, lowpass
from axisight.robot import Robot

Array = NDArray[np.float64]

# A gear alone: a joint whose link pulls with the torque [Nm] that stands for its gravity.
_GEAR = """
schema = "axisight.robot/2"
name = "gear"
gravity = [0.0, 0.0, {torque:.17g}]
sample_time = 0.001

[[joint]]
name = "gear"
kind = "driven"
motion = "revolute"
origin = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
stiffness = {stiffness:.17g}
damping = 1.0

[joint.link]
mass = 1.0
com = [1.0, 0.0, 0.0]
inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]

[joint.drive]
gear_ratio = {ratio:.17g}
motor_inertia = 1.0
viscous_friction = 0.0
"""


@dataclass(frozen=True)
class GearReadings:
    """Readings of the gears of logs with joint encoders.

    ``log``, ``axis`` (n_readings,): from 0; ``torque_nm``, ``deflection_rad``, ``std_rad`` (n_readings,): joint side,
    to one side.
    """

    robot: Robot
    log: NDArray[np.int64]
    axis: NDArray[np.int64]
    torque_nm: Array
    deflection_rad: Array
    std_rad: Array

    def residual(self, own: Mapping[str, float], effects: Sequence[Effect]) -> Array:
        """Return the simulator's readings minus the measured ones (n_readings,), in standard deviations.

        ``own``: the simulator's parameters by name; ``effects``: replace its own effects of the same label.
        """
        every = {e.label: e for e in (*self.robot.effects, *effects)}.values()
        found = [
            self._reading(axis, torque, own, [e for e in every if _is_of_gear(e, axis + 1)])
            for axis, torque in zip(self.axis.tolist(), self.torque_nm.tolist(), strict=True)
        ]
        return (np.array(found) - self.deflection_rad) / self.std_rad

    def _reading(
        self, axis: int, torque: float, own: Mapping[str, float], effects: Sequence[Effect]
    ) -> float:
        name = self.robot.axis_parameter(axis + 1, "stiffness")
        assert name is not None  # readings are taken of elastic gears only
        stiffness = own.get(name, self.robot.parameters()[name])
        ratio = float(self.robot.gear_ratio[axis])
        here = core_effects([replace(e, axis=1) for e in effects])

        def deflection(load: float) -> float:
            core = _core.Robot.from_toml(
                _GEAR.format(torque=load, stiffness=stiffness, ratio=ratio)
            )
            rest = core.equilibrium(here, [0.0])
            return float(rest["motor_angle"][0]) * ratio - float(rest["joint_angle"][0])

        return 0.5 * (deflection(torque) - deflection(-torque))

    def feels(self, name: str, effect: Effect | None) -> bool:
        """Whether a parameter changes a reading: of an effect, or of the simulator if ``effect`` is None."""
        axes = {int(axis) + 1 for axis in self.axis}
        if effect is None:
            return name in {self.robot.axis_parameter(axis, "stiffness") for axis in axes}
        return any(_is_of_gear(effect, axis) for axis in axes)

    def part(self, logs: Sequence[int]) -> GearReadings:
        """Return the readings of some logs, which are numbered anew."""
        number = {log: k for k, log in enumerate(logs)}
        kept = np.flatnonzero(np.isin(self.log, list(logs)))
        return replace(
            self,
            log=np.array([number[int(i)] for i in self.log[kept]], dtype=np.int64),
            axis=self.axis[kept],
            torque_nm=self.torque_nm[kept],
            deflection_rad=self.deflection_rad[kept],
            std_rad=self.std_rad[kept],
        )


def gear_readings(robot: Robot, logs: Sequence[Log], model_error: float) -> GearReadings | None:
    """Return the readings of logs with joint encoders; None if there are none of an elastic gear.

    The standard deviation of a reading holds four parts:

    - the noise of both encoders, that of one sample;
    - the scatter of the deflection under one torque, as impacts in a play make it;
    - the deflection of the simulator's gear under the difference between the torques of motor and link, which friction
      and load that the simulator lacks make;
    - ``model_error`` [1] of the reading.
    """
    stiffness = stiffnesses(robot)
    rows = []
    for k, log in enumerate(logs):
        if log.joint_position_rad is None:
            continue
        noise, driven, loaded = (
            _noise(robot, log),
            _from_motor(robot, log),
            joint_torque(log, robot),
        )
        for axis, bends in enumerate(bends_of(log, robot)):
            both = bends_along(driven[:, axis], loaded[:, axis])
            if bends is None or both is None or not np.isfinite(stiffness[axis]):
                continue
            for bend, torque in zip(bends, both, strict=True):
                # Half a distance of torques stands where deflections do.
                rigid = (torque.deflection_rad - bend.torque_nm) / stiffness[axis]
                parts = (noise[axis], bend.scatter_rad, rigid, model_error * bend.deflection_rad)
                std = float(np.linalg.norm(parts))
                rows.append((k, axis, bend.torque_nm, bend.deflection_rad, std))
    if not rows:
        return None
    log_of, axis_of, *numbers = (np.array(column) for column in zip(*rows, strict=True))
    return GearReadings(robot, log_of, axis_of, *numbers)


def _noise(robot: Robot, log: Log) -> Array:
    """Return the noise of the angle between both encoders (n_axes,) [rad, joint side]; NaN without a joint encoder."""
    assert log.joint_position_rad is not None  # checked before
    motor = np.abs(robot.gear_ratio) * white_std(log.position_rad, log.sample_time_s)
    return np.asarray(np.hypot(motor, white_std(log.joint_position_rad, log.sample_time_s)))


def _from_motor(robot: Robot, log: Log) -> Array:
    """Return the torque that the motors put into the gears (n, n_axes) [Nm, joint side]."""
    cutoff, values = highest_cutoff_hz(log.sample_time_s), robot.parameters()
    speed, acceleration = differentiate(log.position_rad, log.sample_time_s, cutoff)
    rotor, viscous = (
        np.array(
            [values.get(robot.axis_parameter(i, name) or "", 0.0) for i in robot.axis_numbers()]
        )
        for name in ("motor_inertia", "viscous_friction")
    )
    torque = lowpass(log.torque_nm, log.sample_time_s, cutoff)
    return np.asarray((torque - rotor * acceleration - viscous * speed) / robot.gear_ratio)


def _is_of_gear(effect: Effect, axis: int) -> bool:
    return effect.axis == axis and effect_info(effect.name).acts == "transmission"
