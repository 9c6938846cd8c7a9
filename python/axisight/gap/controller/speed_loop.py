"""Turns a controller of positions into the equal speed loop, if its logs hold speed references.

``u = kp (phi_ref - phi) + kd (w_ref - w)``, with ``phi_ref`` the sum of ``w_ref``, is a ``pi_velocity`` with
the proportional gain ``kd`` and the integral gain ``kp``. As a speed loop, machine and simulator can be
compared under the same references, which shows more of elastic gears than inverse dynamics.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import tomlkit
from numpy.typing import NDArray

from axisight.effects.stated import OTHER_GAINS
from axisight.errors import InputError
from axisight.gap.controller.feedback import before, inertia_of_motors
from axisight.gap.controller.other_controllers import check_gains, is_continuous, other_controllers
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Options of a ``pd_position`` that no speed loop has.
_OF_THE_ROBOT = ("gravity_compensation", "computed_torque")
_MORE = (*_OF_THE_ROBOT, "continuous")
# Largest relative difference between the sample times of a log and of the controller.
_SAME_CLOCK = 1e-3
# Largest deviation of position targets from the sum of their speeds, relative to the travel of the motor or 1
# rad.
_SAME = 1e-6


def as_speed_loop(robot: Robot, logs: Sequence[Log]) -> Robot:
    """Return the robot with its ``pd_position`` as a speed loop; unchanged if that is not the same law for all logs.

    All logs need torques, and speed references whose sum is the position target; or no references at all, so
    that they may be reconstructed. The robot stays unchanged if its gains are uncertain. It also stays
    unchanged if the logs show other gains: a cause names these as the robot file does.
    """
    if robot.controller_kind != "pd_position" or not _may_be_speed_loop(robot):
        return robot
    if not all(log.has_torque for log in logs):
        return robot
    if all(log.velocity_ref_rad_s is None and log.position_ref_rad is None for log in logs):
        return _as_pi_velocity(robot)
    if not all(map(_targets_are_summed_speeds, logs)):
        return robot
    loop = _as_pi_velocity(robot)
    shown = other_controllers(loop, logs)
    return robot if any(cause.name == OTHER_GAINS[0] for cause in shown) else loop


def _may_be_speed_loop(robot: Robot) -> bool:
    """Whether the law is sampled, uses speed references, and has two certain gains and no other option."""
    stated = tomlkit.parse(robot.toml).unwrap()["controller"]
    more = any(stated.get(name) for name in _MORE) or robot.stepped is not None
    return not more and robot.velocity_feedforward and not {"kp", "kd"} & robot.tolerances.keys()


def _targets_are_summed_speeds(log: Log) -> bool:
    speed, target = log.velocity_ref_rad_s, log.position_ref_rad
    if speed is None:
        return False
    if target is None:
        return True
    off = target - np.stack([before(w) for w in speed.T], axis=1) * log.sample_time_s
    return bool(np.all(np.ptp(off, axis=0) <= _SAME * np.maximum(np.ptp(target, axis=0), 1.0)))


def _as_pi_velocity(robot: Robot) -> Robot:
    gains = robot.controller_gains
    return _speed_loop(robot, np.asarray(gains["kd"]), np.asarray(gains["kp"]))


def other_controllers_of_targets(robot: Robot, logs: Sequence[Log]) -> tuple[AlgebraicCause, ...]:
    """Return how the controller of a ``pd_position`` differs from the stated one; empty if the logs cannot tell.

    Logs need torques and references, at the controller's sample time; for a continuous law, measured speeds
    instead. Empty too if a gain is farther off than the simulator's effect allows.
    """
    if robot.controller_kind != "pd_position" or {"kp", "kd"} & robot.tolerances.keys():
        return ()
    stated = tomlkit.parse(robot.toml).unwrap()["controller"]
    if any(stated.get(name) for name in _OF_THE_ROBOT):
        return ()
    if not all(_shows_controller(robot, log) for log in logs):
        return ()
    found = other_controllers(robot, logs)
    try:
        check_gains(found)
    except InputError:
        return ()
    return found


def _shows_controller(robot: Robot, log: Log) -> bool:
    if not log.has_torque or (log.position_ref_rad is None and log.velocity_ref_rad_s is None):
        return False
    if is_continuous(robot):
        return log.velocity_rad_s is not None and bool(np.isfinite(log.velocity_rad_s).all())
    return abs(log.sample_time_s / robot.sample_time_s - 1) < _SAME_CLOCK


def with_integral(robot: Robot) -> Robot:
    """Return the robot with an integral gain in its ``p_velocity``, which damps the loop of each motor critically.

    For rigid axes: ``ki = kp^2 / (4 J)``. A loop that keeps a simulator on a log must also hold its angle.
    Without an integral the angle drifts by the error of the speed, and the phase of a ripple is lost.
    """
    if robot.controller_kind != "p_velocity":
        return robot
    kp = np.asarray(robot.controller_gains["kp"])
    return _speed_loop(robot, kp, kp**2 / (4 * np.diag(inertia_of_motors(robot))))


def _speed_loop(robot: Robot, kp: Array, ki: Array) -> Robot:
    document = tomlkit.parse(robot.toml)
    document["controller"] = {"kind": "pi_velocity", "kp": kp.tolist(), "ki": ki.tolist()}
    loop = Robot.from_toml(tomlkit.dumps(document))
    loop = loop.with_parameters(robot.parameters()).with_effects(robot.effects)
    return loop.with_torque_constants(robot.torque_constants)
