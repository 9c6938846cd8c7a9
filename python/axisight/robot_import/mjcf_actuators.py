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
# Kinds of transmissions to a joint: in the frame of the child or of the parent, the same for one axis.
_OF_JOINTS = (0, 1)


def is_gain(value: float) -> bool:
    """Whether a gain of an actuator may be that of a motor: torque per torque that is commanded."""
    return _GAINS[0] <= value <= _GAINS[1]


def numbers(model: Any, name: str, usual: Any) -> Array:
    """Return an array of a compiled model, ``usual`` where this MuJoCo does not know it yet."""
    return np.asarray(getattr(model, name, usual), dtype=np.float64)


class Actuators:
    """The actuators of a compiled model, counted as MuJoCo does; ``joint`` (n,) is -1 for those of none.

    ``gear``, ``armature`` [kg m^2], ``damping`` [Nm s/rad] (before the gear), ``delay`` [s], ``lag`` [s] and
    ``gain`` (n,) are numbers of each; ``limited`` and ``ctrlrange`` of its first command.
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
        self.limited = np.asarray(model.actuator_ctrllimited, dtype=bool)[command]
        low, self.highest = model.actuator_ctrlrange[command].T
        self.limited_both_ways = self.limited & (self.highest > 0) & (low == -self.highest)

    def is_motor(self, i: int) -> bool:
        """Whether one is a source of torque: a gain about one, no bias, no state but that of a lag."""
        model = self.model
        plain = model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 0
        torque = is_gain(float(self.gain[i]))
        return bool(plain and torque and model.actuator_dyntype[i] in (0, *_FILTERS))

    def is_servo(self, i: int) -> bool:
        """Whether one is told positions: ``kp (target - length) - kd speed``, without a state of its own."""
        model = self.model
        affine = model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 1
        kp, bias = self.gain[i], model.actuator_biasprm[i]
        law = bias[0] == 0 and bias[1] == -kp and bias[2] <= 0 and kp > 0
        return bool(affine and law and model.actuator_dyntype[i] == 0)

    def known(self) -> Mapping[int, list[int]]:
        """Return the motors and servos of each joint that has any."""
        found: dict[int, list[int]] = {}
        for i in range(self.n):
            if self.joint[i] >= 0 and (self.is_motor(i) or self.is_servo(i)):
                found.setdefault(int(self.joint[i]), []).append(i)
        return found

    def of_one(self, values: Array) -> dict[int, float]:
        """Return values of actuators by joint, of joints that one motor or servo drives."""
        return {j: float(values[own[0]]) for j, own in self.known().items() if len(own) == 1}

    def ratios(self) -> dict[int, float]:
        """Return the gear ratio of joints that one motor drives: one over its gear."""
        return {j: 1.0 / g for j, g in self.of_one(self.gear).items() if g != 0}

    def servos(self) -> dict[int, tuple[float, float]]:
        """Return the gains of position and speed of joints whose only actuator is told positions."""
        joints = self.joint.tolist()
        return {
            joints[i]: (float(self.gain[i]), -float(self.model.actuator_biasprm[i, 2]))
            for i in range(self.n)
            if joints[i] >= 0 and joints.count(joints[i]) == 1 and self.is_servo(i)
        }

    def torque_path(self, j: int) -> tuple[float, float, float, float]:
        """Return gain, limit [Nm], delay [s] and lag [s] of a joint that one motor drives; of a servo its delay."""
        plain = (1.0, math.inf, 0.0, 0.0)
        if j in self.servos():
            return (*plain[:2], self.of_one(self.delay)[j], plain[3])
        limit = np.where(self.limited_both_ways, self.highest, math.inf)
        every = (self.gain, limit, self.delay, self.lag)
        gain, largest, delay, lag = (
            self.of_one(values).get(j, usual) for values, usual in zip(every, plain, strict=True)
        )
        return gain, largest, delay, lag

    def added(self, j: int) -> tuple[float, float]:
        """Return inertia and damping that the actuators of a joint add to it, on its side: by the gear twice."""
        own = self.joint == j
        squared = self.gear[own] ** 2
        return float(self.armature[own] @ squared), float(self.damping[own] @ squared)
