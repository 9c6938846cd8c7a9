"""Undoes possible mistakes one at a time, to see whether the simulator then explains the torques."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.gate.by_dynamics.torque_fit import TorqueFit, torque_fit
from axisight.gap.signals.motion import Motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.robot import Robot

Array = NDArray[np.float64]

# Factor that turns a position in a wrong unit into rad.
_UNITS = {
    "position_in_degrees": math.pi / 180.0,
    "position_in_revolutions": 2.0 * math.pi,
    "position_in_mrad": 1e-3,
}
# Smallest logarithm of a gear ratio for which the two sides of the gear differ.
_GEARED = 0.1


@dataclass(frozen=True)
class Mistake:
    """A possible mistake, and how well the torques are explained without it.

    ``axes``: the axes concerned, from 0; ``field``: column stem or key of the robot file.
    """

    name: str
    field: str
    axes: tuple[int, ...]
    words: str
    fit: TorqueFit


def undone(robot: Robot, at: Motion) -> Iterator[Mistake]:
    """Yield each single mistake, undone: swapped and turned columns, units, gravity. The order is always the same."""
    position, speed, acceleration, torque = at
    n = robot.n_axes
    given = predict(robot, at)

    def moved(factor: Array | float, order: Sequence[int] | slice = slice(None)) -> TorqueFit:
        """Return the fit with columns in the given order, multiplied by ``factor``."""
        p, v, a = (x[:, order] * factor for x in (position, speed, acceleration))
        return torque_fit(torque, predict(robot, (p, v, a, torque)), (p, v, a, torque))

    for i in range(n):
        for j in range(i):
            order = list(range(n))
            order[i], order[j] = j, i
            words = f"exchange axes {j + 1} and {i + 1}"
            exchanged = torque_fit(torque[:, order], given, at)
            yield Mistake("axes_swapped", "torque_cmd", (j, i), words, exchanged)
            yield Mistake("axes_swapped", "position", (j, i), words, moved(1.0, order))
    for i in range(n):
        sign = np.ones(n)
        sign[i] = -1.0
        words = f"change the sign of axis {i + 1}"
        turned = torque_fit(torque * sign, given, at)
        yield Mistake("sign_flipped", "torque_cmd", (i,), words, turned)
        yield Mistake("sign_flipped", "position", (i,), words, moved(sign))
    every = tuple(range(n))
    if n > 1:
        words = "change the sign of all torques: these are the loads, not the torques of the drives"
        yield Mistake("sign_flipped", "torque_cmd", every, words, torque_fit(-torque, given, at))
    for name, factor in _UNITS.items():
        yield Mistake(name, "position", every, f"multiply by {factor:.4g}", moved(factor))
    if np.any(np.abs(np.log(np.abs(robot.gear_ratio))) > _GEARED):
        words = "divide by the gear ratios"
        yield Mistake("position_joint_side", "position", every, words, moved(1 / robot.gear_ratio))
    turned = with_gravity(robot, at, -1.0)
    yield Mistake("gravity_flipped", "gravity", every, "change the sign of gravity", turned)


def predict(robot: Robot, at: Motion) -> Array:
    """Return the torque of the simulator as given along a motion (n, n_axes) [Nm]."""
    position, speed, acceleration, torque = (np.ascontiguousarray(x) for x in at)
    return predicted_torque(robot, AS_GIVEN, (position, speed, acceleration, torque))


def with_gravity(robot: Robot, at: Motion, factor: float) -> TorqueFit:
    """Fit with gravity times a factor: the prediction with another multiple of the torque at zero speed."""
    still = np.zeros_like(at[1])
    weight = predict(robot, (at[0], still, still, at[3]))
    return torque_fit(at[3], predict(robot, at) + (factor - 1.0) * weight, at)
