"""Torque along a designed motion, for robots whose controller is not known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.arguments import Real
from axisight.robot import Robot


def rigid_torque(
    robot: Robot, velocity: Real, acceleration: Real, start_rad: Sequence[float] | None
) -> Real:
    """Return motor torques [Nm] of the robot without elasticity, (experiment, sample, axis).

    ``velocity`` [rad/s] and ``acceleration`` [rad/s^2] of the motors have the same shape. The
    motion starts at the equilibrium ``start_rad``; elastic joints keep their deflection there.
    Inverse dynamics:
    ``tau = J_m phi'' + F_v phi' + r (M(q) q'' + c(q, q') + g(q))`` with ``q = r phi``.
    """
    rest = robot.equilibrium(start_rad)["joint_angle_rad"].values
    driven, ratio = robot.axis_joints, robot.gear_ratio
    moved = np.cumsum(velocity, axis=1) - velocity
    shape = (velocity.shape[0] * velocity.shape[1], robot.n_joints)
    q, v, a = np.tile(rest, (shape[0], 1)), np.zeros(shape), np.zeros(shape)
    q[:, driven] += (ratio * robot.sample_time_s * moved).reshape(shape[0], -1)
    v[:, driven] = (ratio * velocity).reshape(shape[0], -1)
    a[:, driven] = (ratio * acceleration).reshape(shape[0], -1)
    joint = robot.inverse_dynamics(q, v, a)[:, driven].reshape(velocity.shape)
    known = robot.parameters()
    names = [robot.joint_names[j] for j in driven]
    inertia = np.array([known[f"{name}.motor_inertia"] for name in names])
    friction = np.array([known[f"{name}.viscous_friction"] for name in names])
    return np.asarray(inertia * acceleration + friction * velocity + ratio * joint)
