"""Actuators of a compiled MJCF: find the motors and servos of single joints, and their parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.effects.dcmotor import Device
from axisight.robot_import.mjcf.motors import Motors

Array = NDArray[np.float64]

# MuJoCo's number of the bias that is linear in position and speed.
_AFFINE = 1
# Range of torque per command in which an actuator may be a motor; outside it, commands are not torques.
_GAINS = (0.2, 3.0)
# MuJoCo's numbers of the actuator dynamics that are first-order lags.
_FILTERS = (2, 3)
# MuJoCo's number of the dynamics that integrates commands to a target.
_INTEGRATOR = 1
# MuJoCo's numbers of transmissions to a joint, in the child or the parent frame; equal for a single axis.
_OF_JOINTS = (0, 1)


def is_gain(value: float) -> bool:
    """Whether an actuator gain may be that of a motor, as torque per commanded torque."""
    return _GAINS[0] <= value <= _GAINS[1]


def numbers(model: Any, name: str, usual: Any) -> Array:
    """Return an array of a compiled model, or ``usual`` if this version of MuJoCo does not have it."""
    return np.asarray(getattr(model, name, usual), dtype=np.float64)


def limits_of(limited: Any, ranges: Any) -> Array:
    """Return limits (n,) from ranges (n, 2): infinite if not limited, NaN if the range is not symmetric."""
    low, high = np.asarray(ranges, dtype=np.float64).T
    alike = np.where((high > 0) & (low == -high), high, np.nan)
    return np.asarray(np.where(np.asarray(limited, dtype=bool), alike, np.inf))


def ranges_of(limited: Any, ranges: Any) -> Array:
    """Return ranges (n, 2), infinite if not limited."""
    free = np.array([-np.inf, np.inf])
    return np.where(np.asarray(limited, dtype=bool)[:, None], np.asarray(ranges, float), free)


class Actuators:
    """The n actuators of a compiled model, with MuJoCo's numbers.

    Arrays are (n,): ``joint`` is the number of the joint, -1 without one. ``gear``, ``armature`` [kg m^2],
    ``damping`` [Nm s/rad] (before the gear), ``delay`` [s], ``lag`` [s] and ``gain`` are those of MuJoCo.
    ``command_range`` of the first command and ``force_range`` [Nm] before the gear are (n, 2), infinite if not
    limited. Limits are as from `limits_of`: ``command_limit`` and ``force_limit`` of these ranges, and
    ``joint_limit`` (njnt,) [Nm] of all actuators of a joint together, after the gear.
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self.n = n = int(getattr(model, "nactuator", model.nu))
        every = np.arange(n)
        # An actuator may have several commands and outputs, so these have their own numbers.
        command = np.asarray(getattr(model, "actuator_ctrladr", every), dtype=int)
        has_command = np.asarray(getattr(model, "actuator_ctrlnum", np.ones(n))) > 0
        output = np.asarray(getattr(model, "actuator_outadr", every), dtype=int)
        of_joint = np.isin(model.actuator_trntype, _OF_JOINTS)
        self.gear = model.actuator_gear[output, 0]
        motors = Motors(model, self.gear)
        self.motors = [motors.motor(i) for i in range(n)]
        self.laws = [motors.law(i) for i in range(n)]
        passive = np.array([m is not None and m.is_passive for m in self.motors], dtype=bool)
        self.acts_on = np.where(of_joint, model.actuator_trnid[:, 0], -1)
        self.joint = np.where(passive, -1, self.acts_on)
        self.armature = numbers(model, "actuator_armature", np.zeros(n))
        self.damping = numbers(model, "actuator_damping", np.zeros(n))
        self.delay = numbers(model, "actuator_delay", np.zeros(n))
        self.drag = numbers(model, "actuator_dampingpoly", np.zeros((n, 1)))[:, 0]
        told = [m is not None and (m.is_told_torque or m.is_told_voltage) for m in self.motors]
        self.gain = np.where(told, 1.0, model.actuator_gainprm[:, 0])
        self.braking = np.array([0.0 if m is None else m.braking_nm_s_rad for m in self.motors])
        filters = np.isin(model.actuator_dyntype, _FILTERS)
        self.lag = np.where(filters, model.actuator_dynprm[:, 0], 0.0)
        for i, motor in enumerate(self.motors):
            if motor is not None and motor.is_told_torque:
                self.lag[i] = motor.lag_s
        self.offset = np.where(
            model.actuator_biastype == _AFFINE, model.actuator_biasprm[:, 0], 0.0
        )
        self.command_range = np.tile([-np.inf, np.inf], (n, 1))
        self.command_limit = np.full(n, np.inf)
        limited = (
            model.actuator_ctrllimited[command[has_command]],
            model.actuator_ctrlrange[command[has_command]],
        )
        self.command_range[has_command] = ranges_of(*limited)
        self.command_limit[has_command] = limits_of(*limited)
        forces = model.actuator_forcelimited[output], model.actuator_forcerange[output]
        self.force_range, self.force_limit = ranges_of(*forces), limits_of(*forces)
        self.joint_limit = limits_of(model.jnt_actfrclimited, model.jnt_actfrcrange)

    def is_motor(self, i: int) -> bool:
        """Whether actuator ``i`` is a source of torque: a gain near 1, no state except a lag.

        It may have a constant bias. A ``dcmotor`` is one if its only input is its torque or its voltage.
        """
        model, motor = self.model, self.motors[i]
        if motor is not None:
            return motor.is_told_torque or motor.is_told_voltage
        unbiased = model.actuator_biastype[i] == 0 or (
            model.actuator_biastype[i] == _AFFINE and not np.any(model.actuator_biasprm[i, 1:3])
        )
        plain = model.actuator_gaintype[i] == 0 and unbiased
        torque = is_gain(float(self.gain[i]))
        return bool(plain and torque and model.actuator_dyntype[i] in (0, *_FILTERS))

    def is_servo(self, i: int) -> bool:
        """Whether actuator ``i`` has position targets: ``kp (target - length) - kd speed``.

        Its command is the target, or the speed of the target (`sums_up`).
        """
        motor, own = self.motors[i], self.laws[i]
        if own is not None:
            return own.is_servo if motor is None else motor.is_servo
        kp, bias = self.gain[i], self.model.actuator_biasprm[i]
        law = bias[1] == -kp and bias[2] <= 0 and kp > 0
        return bool(
            self._is_affine(i) and law and self.model.actuator_dyntype[i] in (0, _INTEGRATOR)
        )

    def filtered_servo_s(self, i: int) -> float:
        """Return the time constant [s] by which a position servo lags its targets; 0 for other actuators."""
        kp, bias = self.gain[i], self.model.actuator_biasprm[i]
        law = self._is_affine(i) and bias[1] == -kp and kp > 0
        return float(self.lag[i]) if law else 0.0

    def sums_up(self, i: int) -> bool:
        """Whether actuator ``i`` integrates speed commands to its target, which is its activation."""
        return bool(self.model.actuator_dyntype[i] == _INTEGRATOR)

    def has_sum(self, j: int) -> bool:
        """Whether any actuator of joint ``j`` integrates its commands."""
        return any(self.sums_up(i) for i in np.flatnonzero(self.joint == j).tolist())

    def is_speed_servo(self, i: int) -> bool:
        """Whether actuator ``i`` has speed targets: ``kv (target - speed)``, without a state."""
        kv, bias = self.gain[i], self.model.actuator_biasprm[i]
        law = bias[0] == 0 and bias[1] == 0 and bias[2] == -kv and kv > 0
        return bool(self._is_affine(i) and law and self.model.actuator_dyntype[i] == 0)

    def _is_affine(self, i: int) -> bool:
        model = self.model
        return bool(model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == _AFFINE)

    def known(self) -> Mapping[int, list[int]]:
        """Return the motors and position servos by joint; a speed servo counts if it is the only actuator."""
        found: dict[int, list[int]] = {}
        joints = self.joint.tolist()
        for i, joint in enumerate(joints):
            alone = joints.count(joint) == 1 and self.is_speed_servo(i)
            if joint >= 0 and (self.is_motor(i) or self.is_servo(i) or alone):
                found.setdefault(int(joint), []).append(i)
        return found

    def drives_alone(self, i: int) -> bool:
        """Whether actuator ``i`` is the only motor or servo of its joint."""
        return bool(self.known().get(int(self.joint[i])) == [i])

    def of_one(self, values: Array) -> dict[int, float]:
        """Return the value of the actuator, by joint, for joints with a single motor or servo."""
        return {j: float(values[own[0]]) for j, own in self.known().items() if len(own) == 1}

    def ratios(self) -> dict[int, float]:
        """Return the gear ratio, by joint, for joints with a single motor or servo: 1 / ``gear``."""
        return {j: 1.0 / g for j, g in self.of_one(self.gear).items() if g != 0}

    def servos(self) -> dict[int, tuple[float, float]]:
        """Return the gains on position [Nm/rad] and speed [Nm s/rad], by joint, of position servos.

        Only joints with a single actuator are included.
        """
        joints = self.joint.tolist()
        return {
            joints[i]: self._gains(i)
            for i in range(self.n)
            if joints[i] >= 0 and joints.count(joints[i]) == 1 and self.is_servo(i)
        }

    def _gains(self, i: int) -> tuple[float, float]:
        """Return the gains of the position servo ``i``."""
        law = self.laws[i]
        if law is not None:
            return law.kp, law.kd
        return float(self.gain[i]), -float(self.model.actuator_biasprm[i, 2])

    def devices(self, j: int) -> tuple[Device, ...]:
        """Return cogging and bristles of all motors that act on joint ``j``."""
        found = [m for i, m in enumerate(self.motors) if m is not None and self.acts_on[i] == j]
        return tuple(device for motor in found for device in motor.devices)

    def offset_nm(self, j: int) -> float:
        """Return the constant torque [Nm], before the gear, of the only motor or servo of joint ``j``."""
        return self.of_one(self.offset).get(j, 0.0)

    def speed_gains(self) -> dict[int, float]:
        """Return the gain [Nm s/rad], by joint, for joints whose only actuator is a speed servo."""
        known = self.known().items()
        return {
            j: float(self.gain[own[0]])
            for j, own in known
            if len(own) == 1 and self.is_speed_servo(own[0])
        }

    def torque_path(self, j: int) -> tuple[float, float, float, float]:
        """Return gain, limit [Nm], delay [s] and lag [s] of the motor of joint ``j``.

        For a servo, gain and lag are 1 and 0. The delay acts on the command, so a servo that integrates its
        commands has no delay after its target.
        """
        own = self.known().get(j, [])
        if len(own) != 1:
            # The gear ratio is 1 here, so the joint-side limit is that of the motor.
            return 1.0, _least(self.joint_limit[j]) if j in self.joint else math.inf, 0.0, 0.0
        (i,) = own
        limit = self._limit_nm(i)
        if self.is_motor(i):
            return float(self.gain[i]), limit, float(self.delay[i]), float(self.lag[i])
        late = j in self.servos() and not self.sums_up(i)
        return 1.0, limit, float(self.delay[i]) if late else 0.0, 0.0

    def _limit_nm(self, i: int) -> float:
        """Return the largest torque [Nm], before the gear, of the only actuator of a joint.

        For a motor it is the largest command, for a servo the largest torque.
        """
        behind = self.force_limits(int(self.joint[i]))
        gear = abs(float(self.gear[i])) or 1.0
        given = _least(behind[0], behind[1] / gear)
        if not self.is_motor(i):
            return given
        # The command limit acts before gain, lag and offset, so a force limit is equivalent only without these.
        plain = self.lag[i] == 0 and self.offset[i] == 0
        told = given / float(self.gain[i]) if plain else math.inf
        return _least(self.command_limit[i], told)

    def force_limits(self, j: int) -> tuple[float, float]:
        """Return two limits [Nm] of joint ``j``: of its only actuator, before the gear, and of the joint."""
        own = self.known().get(j, [])
        of_actuator = float(self.force_limit[own[0]]) if len(own) == 1 else math.inf
        return of_actuator, float(self.joint_limit[j]) if j in self.joint else math.inf

    def added(self, j: int) -> tuple[float, float, float]:
        """Return what actuators add to joint ``j``, joint-side.

        These are inertia [kg m^2], damping [Nm s/rad] and drag [Nm s^2/rad^2].
        """
        own = self.acts_on == j
        squared, damping = self.gear[own] ** 2, self.damping[own] + self.braking[own]
        # MuJoCo multiplies all coefficients of damping by the squared gear, and takes the speed of the joint.
        drag = self.drag[own] @ squared
        return float(self.armature[own] @ squared), float(damping @ squared), float(drag)


def _least(*limits: float) -> float:
    """Return the smallest of the limits that are not NaN, infinite without any."""
    return min((float(x) for x in limits if not math.isnan(x)), default=math.inf)
