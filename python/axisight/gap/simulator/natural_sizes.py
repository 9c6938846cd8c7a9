"""Natural sizes of effects on a robot: the amplitude that is large on this robot, by its unit.

The table of effects states sizes for large robots. On a small robot, such a friction would throw the
simulator off any log, and a derivative with that step would be useless.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from axisight.effects import Effect, effect_info
from axisight.gap.simulator.stated_amplitude import stated_values
from axisight.logs import Log
from axisight.robot import Robot

# Natural size, as a share of the torque, inertia or mass of an axis, like the production scatter of parameters.
# With 25 %, a small torque in quiet logs of slow motions is 1000 times the noise, and would count as chaos.
_SHARE = 0.02
# Samples between the angles of a speed or an acceleration; over that many, noise of the angles does not matter.
_APART = 20


@dataclass(frozen=True)
class AxisSizes:
    """Reference sizes of an axis: motion and torque [Nm] of its motor in the logs, and values of its robot.

    ``ratio``: joint angle per motor angle; ``stiffness`` [Nm/rad, joint side], None for a rigid gear;
    ``motor_inertia`` [kg m^2]; ``last_kg``: mass of the last link [kg]; ``travel_rad``: range of the joint angle.
    """

    torque_nm: float
    speed_rad_s: float
    acceleration_rad_s2: float
    ratio: float
    stiffness: float | None
    motor_inertia: float
    last_kg: float
    travel_rad: float

    def of_torque(self, unit: str) -> float | None:
        """Return the amplitude with which an effect alone gives ``torque_nm``, by its unit; None if it is no torque."""
        if unit == "Nm/rad (joint side)":
            return self.torque_nm / self.ratio / self.travel_rad if self.travel_rad > 0 else None
        torques = ("Nm", "Nm s/rad", "Nm s^2/rad^2", "Nm (joint side)")
        return _BY_UNIT[unit](self) if unit in torques else None

    @property
    def deflection_rad(self) -> float:
        """Deflection of the gear under the torque [rad, joint side]."""
        return np.inf if self.stiffness is None else self.torque_nm / self.ratio / self.stiffness


# Reference size of an amplitude on an axis, by its unit.
_BY_UNIT: Mapping[str, Callable[[AxisSizes], float]] = {
    "Nm": lambda a: a.torque_nm,
    "Nm s/rad": lambda a: a.torque_nm / a.speed_rad_s,
    "Nm s^2/rad^2": lambda a: a.torque_nm / a.speed_rad_s**2,
    "Nm (joint side)": lambda a: a.torque_nm / a.ratio,
    "Nm s^2/rad": lambda a: a.motor_inertia,
    "kg m^2": lambda a: a.torque_nm / a.acceleration_rad_s2,
    "Nm/rad^3": lambda a: a.torque_nm / a.ratio / max(a.deflection_rad, 1e-100) ** 3,
    "Nm/rad (joint side)": lambda a: a.torque_nm / a.ratio,
    "kg m^2 (joint side)": lambda a: a.motor_inertia / a.ratio**2,
    "kg": lambda a: a.last_kg,
    "1/W": lambda a: 1 / max(a.torque_nm * a.speed_rad_s, 1e-300),
}


# Largest torque of an effect that is not far-fetched, as a multiple of the largest torque of the motor.
_FAR_FETCHED = 3.0


class NaturalSizes:
    """Natural sizes of amplitudes on a robot that moves as in its logs."""

    def __init__(self, robot: Robot, logs: Sequence[Log]) -> None:
        self.robot, self.logs = robot, logs

    @cached_property
    def axes(self) -> list[AxisSizes]:
        """The reference sizes of every axis."""
        return [self._axis(place) for place in range(self.robot.n_axes)]

    def of(self, effect: Effect, name: str) -> float:
        """Return the natural size of a parameter of an effect, at most the size in the table of effects."""
        info = effect_info(effect.name)
        parameter = next(p for p in info.parameters if p.name == name)
        of = _BY_UNIT.get(parameter.unit)
        if parameter.unit == "rad (joint side)" and info.acts == "transmission":
            of = _of_gear
        if of is None or parameter.role != "amplitude":
            return parameter.typical
        # An effect on the whole arm takes the smallest size of all axes.
        axes = [a for i, a in enumerate(self.axes, 1) if effect.acts_on(i)]
        most = _SHARE * min(of(a) for a in axes)
        return min(parameter.typical, most) if most > 0 else parameter.typical

    def largest(self, effect: Effect) -> dict[str, float]:
        """Return the size, by amplitude that is a torque, at which an effect begins to be far-fetched.

        It alone gives three times the largest torque of the motor then, and another effect has to take that away again.
        An effect on several axes has the size of the strongest. What the simulator states may be that large.
        """
        stated = stated_values(effect, self.robot)
        axes = [a for i, a in enumerate(self.axes, 1) if effect.acts_on(i)]
        sizes = {
            p.name: _FAR_FETCHED * max((a.of_torque(p.unit) or 0.0 for a in axes), default=0.0)
            for p in effect_info(effect.name).parameters
            if p.role == "amplitude"
        }
        return {
            name: max(size, abs(stated.get(name, 0.0))) for name, size in sizes.items() if size > 0
        }

    def _axis(self, place: int) -> AxisSizes:
        joint = self.robot.joints[self.robot.axis_joints[place]]
        ratio = abs(float(self.robot.gear_ratio[place]))
        masses = [j.link.mass_kg for j in self.robot.joints if j.link is not None]
        return AxisSizes(
            torque_nm=max(float(np.abs(log.torque_nm[:, place]).max()) for log in self.logs),
            speed_rad_s=max(_top_speed(log, place) for log in self.logs),
            acceleration_rad_s2=max(_top_acceleration(log, place) for log in self.logs),
            ratio=ratio,
            stiffness=None if joint.spring is None else joint.spring.stiffness,
            motor_inertia=np.inf if joint.drive is None else joint.drive.motor_inertia,
            last_kg=masses[-1] if masses else np.inf,
            travel_rad=ratio * max(float(np.ptp(log.position_rad[:, place])) for log in self.logs),
        )


def _of_gear(a: AxisSizes) -> float:
    return a.deflection_rad


def _top_speed(log: Log, place: int) -> float:
    """Return the top speed of a motor [rad/s], never zero."""
    angle = log.position_rad[:, place]
    apart = min(_APART, len(angle) - 1)
    moved = np.abs(angle[apart:] - angle[:-apart]).max()
    return max(float(moved) / (apart * log.sample_time_s), 1e-9)


def _top_acceleration(log: Log, place: int) -> float:
    """Return the top acceleration of a motor [rad/s^2], never zero."""
    angle = log.position_rad[:, place]
    apart = min(_APART, (len(angle) - 1) // 2)
    bent = np.abs(angle[2 * apart :] - 2 * angle[apart:-apart] + angle[: -2 * apart]).max()
    return max(float(bent) / (apart * log.sample_time_s) ** 2, 1e-9)
