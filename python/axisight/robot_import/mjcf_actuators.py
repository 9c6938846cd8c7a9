"""Actuators of a compiled MJCF: which are motors or servos of one joint, and their numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Torque per command of what may still be a motor: others have commands that are no torques.
_GAINS = (0.2, 3.0)
# Kinds of dynamics of actuators that are lags of first order, by MuJoCo's numbers.
_FILTERS = (2, 3)
# The kind of dynamics that adds commands up to a target.
_INTEGRATOR = 1
# Kinds of transmissions to a joint: in the frame of the child or of the parent, the same for one axis.
_OF_JOINTS = (0, 1)


def is_gain(value: float) -> bool:
    """Whether a gain of an actuator may be that of a motor: torque per torque that is commanded."""
    return _GAINS[0] <= value <= _GAINS[1]


def numbers(model: Any, name: str, usual: Any) -> Array:
    """Return an array of a compiled model, ``usual`` where this MuJoCo does not know it yet."""
    return np.asarray(getattr(model, name, usual), dtype=np.float64)


def limits_of(limited: Any, ranges: Any) -> Array:
    """Return limits (n,) of ranges (n, 2): infinite without one, not a number where they are not alike both ways."""
    low, high = np.asarray(ranges, dtype=np.float64).T
    alike = np.where((high > 0) & (low == -high), high, np.nan)
    return np.asarray(np.where(np.asarray(limited, dtype=bool), alike, np.inf))


class Actuators:
    """The actuators of a compiled model, counted as MuJoCo does; ``joint`` (n,) is -1 for those of none.

    ``gear``, ``armature`` [kg m^2], ``damping`` [Nm s/rad] (before the gear), ``delay`` [s], ``lag`` [s] and
    ``gain`` (n,) are numbers of each; ``command_limit`` of its first command, ``force_limit`` before the gear
    and ``joint_limit`` (njnt,) of all actuators of a joint, behind it, are as `limits_of` has them.
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self.n = n = int(getattr(model, "nactuator", model.nu))
        every = np.arange(n)
        # One may have several commands, and several outputs.
        command = np.asarray(getattr(model, "actuator_ctrladr", every), dtype=int)
        output = np.asarray(getattr(model, "actuator_outadr", every), dtype=int)
        of_joint = np.isin(model.actuator_trntype, _OF_JOINTS)
        self.joint = np.where(of_joint, model.actuator_trnid[:, 0], -1)
        self.gear = model.actuator_gear[output, 0]
        self.armature = numbers(model, "actuator_armature", np.zeros(n))
        self.damping = numbers(model, "actuator_damping", np.zeros(n))
        self.delay = numbers(model, "actuator_delay", np.zeros(n))
        self.gain = model.actuator_gainprm[:, 0]
        filters = np.isin(model.actuator_dyntype, _FILTERS)
        self.lag = np.where(filters, model.actuator_dynprm[:, 0], 0.0)
        self.command_limit = limits_of(
            model.actuator_ctrllimited[command], model.actuator_ctrlrange[command]
        )
        self.force_limit = limits_of(
            model.actuator_forcelimited[output], model.actuator_forcerange[output]
        )
        self.joint_limit = limits_of(model.jnt_actfrclimited, model.jnt_actfrcrange)

    def is_motor(self, i: int) -> bool:
        """Whether one is a source of torque: a gain about one, no bias, no state but that of a lag."""
        model = self.model
        plain = model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 0
        torque = is_gain(float(self.gain[i]))
        return bool(plain and torque and model.actuator_dyntype[i] in (0, *_FILTERS))

    def is_servo(self, i: int) -> bool:
        """Whether one has a target of positions: ``kp (target - length) - kd speed``.

        It is told the target, or the speed of it, which `sums_up`.
        """
        kp, bias = self.gain[i], self.model.actuator_biasprm[i]
        law = bias[0] == 0 and bias[1] == -kp and bias[2] <= 0 and kp > 0
        return bool(
            self._is_affine(i) and law and self.model.actuator_dyntype[i] in (0, _INTEGRATOR)
        )

    def sums_up(self, i: int) -> bool:
        """Whether the target of one is the sum of the speeds that it is told: its activation."""
        return bool(self.model.actuator_dyntype[i] == _INTEGRATOR)

    def has_sum(self, j: int) -> bool:
        """Whether an actuator of a joint sums up what it is told."""
        return any(self.sums_up(i) for i in np.flatnonzero(self.joint == j).tolist())

    def is_speed_servo(self, i: int) -> bool:
        """Whether one is told speeds: ``kv (target - speed)``, without a state of its own."""
        kv, bias = self.gain[i], self.model.actuator_biasprm[i]
        law = bias[0] == 0 and bias[1] == 0 and bias[2] == -kv and kv > 0
        return bool(self._is_affine(i) and law and self.model.actuator_dyntype[i] == 0)

    def _is_affine(self, i: int) -> bool:
        model = self.model
        return bool(model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 1)

    def known(self) -> Mapping[int, list[int]]:
        """Return the motors and servos of each joint that has any; one that is told speeds where it is the only one."""
        found: dict[int, list[int]] = {}
        joints = self.joint.tolist()
        for i, joint in enumerate(joints):
            alone = joints.count(joint) == 1 and self.is_speed_servo(i)
            if joint >= 0 and (self.is_motor(i) or self.is_servo(i) or alone):
                found.setdefault(int(joint), []).append(i)
        return found

    def drives_alone(self, i: int) -> bool:
        """Whether one is the motor or servo by which its joint is taken."""
        return bool(self.known().get(int(self.joint[i])) == [i])

    def of_one(self, values: Array) -> dict[int, float]:
        """Return values of actuators by joint, of joints that one motor or servo drives."""
        return {j: float(values[own[0]]) for j, own in self.known().items() if len(own) == 1}

    def ratios(self) -> dict[int, float]:
        """Return the gear ratio of joints that one motor drives: one over its gear."""
        return {j: 1.0 / g for j, g in self.of_one(self.gear).items() if g != 0}

    def servos(self) -> dict[int, tuple[float, float]]:
        """Return the gains of position and speed of joints whose only actuator has a target of positions."""
        joints = self.joint.tolist()
        return {
            joints[i]: (float(self.gain[i]), -float(self.model.actuator_biasprm[i, 2]))
            for i in range(self.n)
            if joints[i] >= 0 and joints.count(joints[i]) == 1 and self.is_servo(i)
        }

    def speed_gains(self) -> dict[int, float]:
        """Return the gains of joints whose only actuator is told speeds."""
        known = self.known().items()
        return {
            j: float(self.gain[own[0]])
            for j, own in known
            if len(own) == 1 and self.is_speed_servo(own[0])
        }

    def torque_path(self, j: int) -> tuple[float, float, float, float]:
        """Return gain, limit [Nm], delay [s] and lag [s] of the motor of a joint; of a servo limit and delay.

        What one is told is late: of one that sums it up, its target is late already, and no delay follows it.
        """
        own = self.known().get(j, [])
        if len(own) != 1:
            # Without a gear that is taken, a motor is on the side of the joint.
            return 1.0, _least(self.joint_limit[j]) if j in self.joint else math.inf, 0.0, 0.0
        (i,) = own
        limit = self._limit_nm(i)
        if self.is_motor(i):
            return float(self.gain[i]), limit, float(self.delay[i]), float(self.lag[i])
        late = j in self.servos() and not self.sums_up(i)
        return 1.0, limit, float(self.delay[i]) if late else 0.0, 0.0

    def _limit_nm(self, i: int) -> float:
        """Return the largest torque before the gear that the only actuator of a joint is told, or gives."""
        behind = self.force_limits(int(self.joint[i]))
        gear = abs(float(self.gear[i])) or 1.0
        given = _least(behind[0], behind[1] / gear)
        if not self.is_motor(i):
            return given
        # A command is limited before the gain and the lag.
        told = given / float(self.gain[i]) if self.lag[i] == 0 else math.inf
        return _least(self.command_limit[i], told)

    def force_limits(self, j: int) -> tuple[float, float]:
        """Return the limits of the force of a joint's only actuator, before its gear, and of all that act on it."""
        own = self.known().get(j, [])
        of_actuator = float(self.force_limit[own[0]]) if len(own) == 1 else math.inf
        return of_actuator, float(self.joint_limit[j]) if j in self.joint else math.inf

    def added(self, j: int) -> tuple[float, float]:
        """Return inertia and damping that the actuators of a joint add to it, on its side: by the gear twice."""
        own = self.joint == j
        squared = self.gear[own] ** 2
        return float(self.armature[own] @ squared), float(self.damping[own] @ squared)


def _least(*limits: float) -> float:
    """Return the least of limits that are numbers, infinite without any."""
    return min((float(x) for x in limits if not math.isnan(x)), default=math.inf)
