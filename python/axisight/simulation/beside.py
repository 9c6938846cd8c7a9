"""The modelled remainder of a robot in its simulation: a torque that is held over each sample."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import instance
from axisight.errors import InputError
from axisight.remainder import RunningRemainder
from axisight.robot import Robot

Array = NDArray[np.float64]
# Torque on the motors [Nm] at time [s], angle, speed, acceleration and load of the motors.
Beside = Callable[[float, Array, Array, Array, Array], Array]


def acting_remainder(
    robot: Robot, given: RunningRemainder | None, model: str
) -> RunningRemainder | None:
    """Return the remainder that acts in a simulation: the ``given`` one, else that of the robot's file.

    Raises InputError for the linear model, another number of axes, and temperatures that nobody states.
    """
    if given is None:
        if robot.remainder is None:
            return None
        given = RunningRemainder(robot.remainder)
    axes = instance("remainder", given, RunningRemainder).remainder.n_axes
    if axes != robot.n_axes:
        raise InputError(f"remainder: expected one of {robot.n_axes} axes, got {axes}")
    if model == "linear":
        raise InputError(
            "model: expected nonlinear for a robot with a remainder, got linear; "
            "robot.with_remainder(None) is without it"
        )
    if given.lacks_temperature:
        raise InputError(
            "remainder: expected RunningRemainder(..., temperature_c=...), as a term depends on it, got no temperatures"
        )
    return given


def beside(running: RunningRemainder, reference: Array | None) -> Beside:
    """Return the torque on the motors of one run from rest: what the machine needs more acts against it.

    ``reference``: the speed references (n, n_axes) [rad/s] of the run, None under given torques. Before an axis
    moves, its last direction is that in which its reference moves first.
    """
    n_axes = running.remainder.n_axes
    way = np.zeros(n_axes) if reference is None else first_way(reference)
    running.restart(way)

    def torque(
        time_s: float, angle: Array, speed: Array, acceleration: Array, load: Array
    ) -> Array:
        return -running(time_s, angle, speed, acceleration, load)

    return torque


def first_way(reference: Array) -> Array:
    """Return the sign of the first reference (n, n_axes) of each axis that is not zero; 0 without one."""
    moves = reference != 0
    first = np.argmax(moves, axis=0)
    return np.asarray(np.sign(reference[first, np.arange(reference.shape[1])]))
