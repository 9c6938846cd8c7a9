"""A controller of positions whose logs hold its references of speed: the speed loop that it is.

``u = kp (phi_ref - phi) + kd (w_ref - w)`` with ``phi_ref`` the sum of ``w_ref`` is a ``pi_velocity`` with the gain
``kd`` of speed and ``kp`` of the sum. As such machine and simulator run under the same references, which
tells of elastic gears what inverse dynamics does not.
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

# What such a law may have that no speed loop has.
_OF_THE_ROBOT = ("gravity_compensation", "computed_torque")
_MORE = (*_OF_THE_ROBOT, "continuous")
# By how much a sample time may be off and still be that of the controller.
_SAME_CLOCK = 1e-3
# Of a motor's travel: targets that stray further from the sum of their rates are others.
_SAME = 1e-6


def as_speed_loop(robot: Robot, logs: Sequence[Log]) -> Robot:
    """Return the robot with the speed loop that its ``pd_position`` is along logs of torques and speeds.

    Or of torques alone, from which references may be recovered. As it is where a log has no torque, targets
    without speeds or others than their sum; where gains are uncertain, or others than those stated
    show, which are told by their names in the file.
    """
    if robot.controller_kind != "pd_position" or not _is_one(robot):
        return robot
    if not all(log.has_torque for log in logs):
        return robot
    if all(log.velocity_ref_rad_s is None and log.position_ref_rad is None for log in logs):
        return _as_one(robot)
    if not all(map(_told_by_speeds, logs)):
        return robot
    loop = _as_one(robot)
    shown = other_controllers(loop, logs)
    return robot if any(cause.name == OTHER_GAINS[0] for cause in shown) else loop


def _is_one(robot: Robot) -> bool:
    """Whether its law is one of samples, of the two gains alone, which are certain, and takes speeds."""
    stated = tomlkit.parse(robot.toml).unwrap()["controller"]
    more = any(stated.get(name) for name in _MORE) or robot.stepped is not None
    return not more and robot.velocity_feedforward and not {"kp", "kd"} & robot.tolerances.keys()


def _told_by_speeds(log: Log) -> bool:
    speed, target = log.velocity_ref_rad_s, log.position_ref_rad
    if speed is None:
        return False
    if target is None:
        return True
    off = target - np.stack([before(w) for w in speed.T], axis=1) * log.sample_time_s
    return bool(np.all(np.ptp(off, axis=0) <= _SAME * np.maximum(np.ptp(target, axis=0), 1.0)))


def _as_one(robot: Robot) -> Robot:
    gains = robot.controller_gains
    return _speed_loop(robot, np.asarray(gains["kd"]), np.asarray(gains["kp"]))


def other_controllers_of_targets(robot: Robot, logs: Sequence[Log]) -> tuple[AlgebraicCause, ...]:
    """Return what is different about the controller of a ``pd_position``, where logs have torques and targets.

    Nothing where these do not tell. Its law is algebra of samples where logs have those of the controller, and
    of measured speeds where it is continuous. Gains so far from the stated ones that no effect has them are none.
    """
    if robot.controller_kind != "pd_position" or {"kp", "kd"} & robot.tolerances.keys():
        return ()
    stated = tomlkit.parse(robot.toml).unwrap()["controller"]
    if any(stated.get(name) for name in _OF_THE_ROBOT):
        return ()
    if not all(_tells(robot, log) for log in logs):
        return ()
    found = other_controllers(robot, logs)
    try:
        check_gains(found)
    except InputError:
        return ()
    return found


def _tells(robot: Robot, log: Log) -> bool:
    if not log.has_torque or (log.position_ref_rad is None and log.velocity_ref_rad_s is None):
        return False
    if is_continuous(robot):
        return log.velocity_rad_s is not None and bool(np.isfinite(log.velocity_rad_s).all())
    return abs(log.sample_time_s / robot.sample_time_s - 1) < _SAME_CLOCK


def with_integral(robot: Robot) -> Robot:
    """Return a robot whose ``p_velocity`` has an integral too, as large as leaves the loop of its motors damped.

    Critically, of rigid axes: ``ki = kp^2 / (4 J)``. What keeps a simulator on a log has to keep its angle, too: with
    none of its own it strays from the waves of a ripple, by what speeds are off.
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
