"""The controller of a machine: velocity PI, with the changes that the machine has and its simulator lacks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.blind.machine import Machine
from axisight.errors import InputError

Array = NDArray[np.float64]


class Controller:
    """Velocity PI; the last dimension of its arrays is the motor, an earlier one may be the run.

    ``angle``: measured motor angles [rad] at the start, at rest. ``holding``: torques [Nm] that hold the arm
    there. Raises InputError for a robot with another controller.
    """

    def __init__(self, machine: Machine, angle: Array, holding: Array) -> None:
        robot, own = machine.robot, machine.of_axes()
        if robot.controller_kind != "pi_velocity":
            raise InputError(f"controller: expected pi_velocity, got {robot.controller_kind}")
        self.sample_s = robot.sample_time_s
        self.kp = robot.controller_gains["kp"] * (1 + np.array([x.kp for x in own]))
        self.ki = robot.controller_gains["ki"] * (1 + np.array([x.ki for x in own]))
        lags = np.array([x.filter_s for x in own])
        # Exact discretization of a first-order lag; 1 without a lag.
        self.fresh = -np.expm1(-self.sample_s / np.maximum(lags, 1e-12))
        self.for_rate = np.array([x.for_rate for x in own])
        self.for_speed = np.array([x.for_speed for x in own])
        self.speed = np.zeros_like(angle)
        self.wanted = np.zeros_like(angle)
        self.measured = angle.copy()
        # Integral of the speed error [rad]; at rest its torque holds the arm.
        self.behind = holding / self.ki

    def command(self, measured: Array, wanted: Array) -> Array:
        """Return the torques [Nm] for measured angles [rad] and wanted speeds [rad/s] of one sample."""
        moved = measured - self.measured
        self.measured = measured
        self.behind = self.behind - moved
        self.speed = self.speed + self.fresh * (moved / self.sample_s - self.speed)
        command = self.kp * (wanted - self.speed) + self.ki * self.behind
        command += self.for_rate * (wanted - self.wanted) / self.sample_s
        command += self.for_speed * wanted
        self.wanted = np.array(wanted)
        self.behind = self.behind + wanted * self.sample_s
        return np.asarray(command)
