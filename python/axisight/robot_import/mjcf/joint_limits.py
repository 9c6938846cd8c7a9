"""Limits of the joints of a compiled MJCF, from the joints and from their actuators."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.robot import JointLimits
from axisight.robot_import.mjcf.actuators import Actuators, ranges_of

Array = NDArray[np.float64]


def limits_of_joint(actuators: Actuators, j: int) -> JointLimits:
    """Return the limits of joint ``j``, joint side.

    The position has the range of the joint, and the targets that its only servo accepts. The speed has the targets that
    an actuator of speeds accepts. The effort has the force ranges of the joint and of its only actuator, and the
    commands of a motor. A range of forces that differs by direction counts by its smaller end.
    """
    model = actuators.model
    position = ranges_of(model.jnt_limited[[j]], model.jnt_range[[j]])[0]
    speed = np.array([-np.inf, np.inf])
    force = ranges_of(model.jnt_actfrclimited[[j]], model.jnt_actfrcrange[[j]])[0]
    own = actuators.known().get(j, [])
    if len(own) == 1 and actuators.gear[own[0]] != 0:
        (i,) = own
        gear = float(actuators.gear[i])
        told = actuators.command_range[i]
        force = _both(force, _turned(actuators.force_range[i], gear))
        motor = actuators.motors[i]
        if motor is not None and motor.is_told_voltage:
            pass  # Its range is one of voltages.
        elif actuators.is_motor(i):
            force = _both(force, _turned(told, float(actuators.gain[i]) * gear))
        elif actuators.is_speed_servo(i) or actuators.sums_up(i):
            speed = _turned(told, 1.0 / gear)
        else:
            position = _both(position, _turned(told, 1.0 / gear))
    low, high = map(float, position)
    bounded = np.isfinite(position).all() and low < high
    return JointLimits(
        (low, high) if bounded else None, velocity=_least(speed), effort=_least(force)
    )


def _turned(ends: Array, by: float) -> Array:
    """Return a range after a gear, whose sign may swap its ends."""
    return np.sort(ends * by)


def _both(one: Array, other: Array) -> Array:
    """Return what two ranges share."""
    return np.array([max(one[0], other[0]), min(one[1], other[1])])


def _least(ends: Array) -> float | None:
    """Return the largest size allowed in either direction; None without a limit, or if zero is not inside."""
    size = float(min(-ends[0], ends[1]))
    return size if 0 < size < np.inf else None
