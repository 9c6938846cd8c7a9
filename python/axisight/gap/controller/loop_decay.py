"""How fast a loop forgets its initial state: the slowest mode of a robot with its sampled controller."""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.controller.feedback import inertia_of_motors
from axisight.robot import Robot

Array = NDArray[np.float64]

FORGOTTEN = 0.01
"""Share of a difference in the initial state that may be left where a comparison begins.

Equal to the formula error of a torque (`Settings.model_error`, 1 %).
"""


def slowest_decay_1_s(robot: Robot, joint_angle_rad: Array) -> float:
    """Return the decay rate [1/s] of the slowest mode of the loop, at rest at the pose (n_axes,) [rad].

    Zero or negative if the loop does not settle. Linear, without delays and limits. The plant is propagated
    exactly from sample to sample (zero-order hold; Astrom and Wittenmark, *Computer-Controlled Systems*, 1997,
    ch. 2). A controller of positions may act between samples, and is taken as continuous.
    """
    plant = robot.linearize(joint_angle_rad.tolist())
    gains = robot.controller_gains
    if "kd" in gains:
        return float(-scipy.linalg.eigvals(_continuous(robot, *plant)).real.max())
    largest = float(np.abs(scipy.linalg.eigvals(_sampled(robot, *plant))).max())
    # Modes of zero end within one sample.
    return -math.log(largest) / robot.sample_time_s if largest > 0 else math.inf


def _continuous(robot: Robot, states: Array, inputs: Array, outputs: Array) -> Array:
    """Return the state matrix of the plant under a continuous controller of positions and speeds."""
    gains = robot.controller_gains
    command = np.diag(gains["kp"]) @ outputs + np.diag(gains["kd"]) @ outputs @ states
    if robot.computed_torque:
        command = inertia_of_motors(robot) @ command
    return np.asarray(states - inputs @ command)


def _sampled(robot: Robot, states: Array, inputs: Array, outputs: Array) -> Array:
    """Return the transition over one sample of the plant, the last measured angles and the controller's sums."""
    n, m = inputs.shape
    time = robot.sample_time_s
    both = np.block([[states, inputs], [np.zeros((m, n + m))]])
    exact = scipy.linalg.expm(both * time)
    gains = {k: np.diag(np.broadcast_to(v, m)) for k, v in robot.controller_gains.items()}
    one, none = np.eye(m), np.zeros((m, m))
    speed = np.hstack([-outputs, one, none]) / time
    angle = np.hstack([-outputs, none, none])
    sums = np.hstack([np.zeros((m, n + m)), one])
    kp, ki = gains["kp"], gains.get("ki", none)
    if "kv" in gains:
        error = speed + gains["kv"] @ angle
        # Without an integral gain the sum has no effect, and a mode that never decays; it is set to zero.
        command, summed = kp @ error + ki @ sums, (ki > 0) @ (sums + time * error)
    else:
        command, summed = kp @ speed + ki @ angle, none @ angle
    plant = np.hstack([exact[:n, :n], np.zeros((n, 2 * m))]) + exact[:n, n:] @ command
    return np.vstack([plant, -angle, summed])
