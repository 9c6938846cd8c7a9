"""The ``pid`` and ``dcmotor`` actuators of a compiled MJCF: gains, motor constants, cogging, bristles.

MuJoCo's documentation of ``actuator/pid`` and ``actuator/dcmotor`` has the laws. The arrangement of their
parameters in the compiled model is that of MuJoCo 3.12 and later; before, no actuator counts as one of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from axisight.effects.dcmotor import Bristles, Cogging, Device

# Bits of `actuator_ctrlspec`: what an actuator is told.
_POSITION, _SPEED, _TORQUE, _VOLTAGE, _NOTHING = 1, 2, 4, 8, 16


@dataclass(frozen=True)
class Law:
    """Gains of an actuator with a controller of its own, before the gear.

    ``kp`` [Nm/rad], ``ki`` [Nm/(rad s)], ``kd`` [Nm s/rad]. ``told``: bits of its inputs.
    """

    told: int
    kp: float
    ki: float
    kd: float
    largest_rate_rad_s: float
    largest_sum_rad_s: float

    @property
    def is_servo(self) -> bool:
        """Whether the law is ``kp (target - angle) - kd speed``."""
        return bool(self.told & _POSITION and self.kp > 0 and not self.beyond())

    def beyond(self) -> list[str]:
        """Return what the law has beside gains on position and speed, in words."""
        out = [f"integral gain {self.ki:g} Nm/(rad s)"] * bool(self.ki)
        out += [f"limit of its sum {self.largest_sum_rad_s:g} rad s"] * bool(
            self.ki and self.largest_sum_rad_s
        )
        return out + [f"limit of the target's rate {self.largest_rate_rad_s:g} rad/s"] * bool(
            self.largest_rate_rad_s
        )

    def unused(self) -> list[str]:
        """Return the inputs of a servo beside its target, which are taken as zero."""
        names = {_SPEED: "target of speed", _TORQUE: "feedforward"}
        return [name for bit, name in names.items() if self.told & bit]


@dataclass(frozen=True)
class Motor:
    """A ``dcmotor``: resistance [Ohm], constant [Nm/A], time constant of the current [s], its controller."""

    resistance_ohm: float
    constant_nm_a: float
    lag_s: float
    largest_voltage: float
    is_thermal: bool
    limits_rate: bool
    law: Law
    devices: tuple[Device, ...]

    @property
    def is_passive(self) -> bool:
        """Whether the motor has no inputs."""
        return bool(self.law.told & _NOTHING)

    @property
    def is_told_voltage(self) -> bool:
        """Whether the only input is the voltage."""
        return self.law.told == _VOLTAGE

    @property
    def is_told_torque(self) -> bool:
        """Whether the only input is the torque, without gains or a limit of the voltage."""
        plain = not (self.law.kp or self.law.kd or self.law.beyond() or self.largest_voltage)
        return self.law.told == _TORQUE and plain

    @property
    def is_servo(self) -> bool:
        """Whether the motor is a position servo without dynamics of its own."""
        return self.law.is_servo and not (self.lag_s or self.largest_voltage)

    @property
    def braking_nm_s_rad(self) -> float:
        """Damping by the back EMF [Nm s/rad], which the controller of a motor told a torque cancels."""
        if not (self.is_passive or self.is_told_voltage):
            return 0.0
        return self.constant_nm_a**2 / self.resistance_ohm

    def beyond(self) -> list[str]:
        """Return what no robot file can state of the motor, in words."""
        out = ["warming of its winding (thermal)"] * self.is_thermal
        out += ["limit of its current's rate (saturation)"] * self.limits_rate
        out += [f"limit of its voltage {self.largest_voltage:g} V"] * bool(self.largest_voltage)
        lagging = self.lag_s and not self.is_told_torque
        return out + [f"lag of its current {self.lag_s:g} s (inductance)"] * bool(lagging)


class Motors:
    """The ``pid`` and ``dcmotor`` actuators of a model with n actuators; ``gear`` (n,) are their gears."""

    def __init__(self, model: Any, gear: Any) -> None:
        self.model, self.gear = model, np.asarray(gear, dtype=np.float64)
        gains = import_module("mujoco").mjtGain
        known = hasattr(model, "actuator_ctrlspec")
        self._pid = int(getattr(gains, "mjGAIN_PID", -1)) if known else -1
        self._dcmotor = int(getattr(gains, "mjGAIN_DCMOTOR", -1)) if known else -1

    def law(self, i: int) -> Law | None:
        """Return the law of actuator ``i``; None unless it is a ``pid`` or a ``dcmotor``."""
        model = self.model
        kind, gain, dynamics = (
            int(model.actuator_gaintype[i]),
            model.actuator_gainprm[i].tolist(),
            model.actuator_dynprm[i].tolist(),
        )
        if kind == self._pid:
            _, kp, kd = (-model.actuator_biasprm[i, :3]).tolist()
            return Law(int(model.actuator_ctrlspec[i]), kp, gain[0], kd, dynamics[1], dynamics[0])
        if kind == self._dcmotor:
            kp, ki, kd = gain[4:7]
            return Law(int(model.actuator_ctrlspec[i]), kp, ki, kd, *dynamics[7:9])
        return None

    def motor(self, i: int) -> Motor | None:
        """Return actuator ``i`` as a DC motor; None unless it is a ``dcmotor``."""
        if int(self.model.actuator_gaintype[i]) != self._dcmotor:
            return None
        law = self.law(i)
        assert law is not None  # a dcmotor has one
        lag, rate, *thermal = self.model.actuator_dynprm[i, :4].tolist()
        resistance, constant = self.model.actuator_gainprm[i, :2].tolist()
        return Motor(
            resistance,
            constant,
            lag,
            float(self.model.actuator_gainprm[i, 7]),
            any(thermal),
            bool(rate),
            law,
            self._devices(i),
        )

    def _devices(self, i: int) -> tuple[Device, ...]:
        """Return cogging and bristles of a ``dcmotor``."""
        gear = float(self.gear[i])
        amplitude, order, phase, *friction = self.model.actuator_biasprm[i, :6].tolist()
        stiffness, damping = self.model.actuator_dynprm[i, 5:7].tolist()
        cogging = Cogging(gear, amplitude, order, phase)
        bristles = Bristles(gear, stiffness, damping, *friction)
        return (*([cogging] if amplitude else []), *([bristles] if stiffness else []))
