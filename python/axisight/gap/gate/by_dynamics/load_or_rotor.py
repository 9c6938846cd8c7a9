"""Tells a wrong scale of a torque from what a machine has and a simulator may lack: a load and a rotor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.effects.stated import LINK_COM, LINK_MASS, LOAD
from axisight.gap.gate.by_dynamics.torque_fit import nuisance
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import Motion
from axisight.robot import Robot
from axisight.robot.branches import tips

Array = NDArray[np.float64]

# Places of a unit mass in the frame of the last link [m], whose torques give those of any load to first order; but
# for the first, they are shifts of a centre of mass, too.
_PLACES = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1))


def load_or_rotor_explains(robot: Robot, at: Motion, axis: int) -> bool:
    """Whether loads on the last links and a rotor explain the torque of an axis (from 0) as well as a factor does.

    Both with friction and an offset, fitted to one half of the log and judged on the other.
    """
    bodies = predict(robot, at)
    own = nuisance(at[1][:, axis])
    scaled = np.column_stack([bodies[:, axis], own])
    loads = [load[:, axis] for load in load_torques(robot, at, bodies)]
    lacking = np.column_stack([*loads, at[2][:, axis], own])
    torque = at[3][:, axis]
    return _left(torque - bodies[:, axis], lacking) <= _left(torque, scaled)


def load_torques(robot: Robot, at: Motion, bodies: Array) -> list[Array]:
    """Return the torques (n, n_axes) [Nm] of masses on the last link of each branch, beside those of the ``bodies``.

    Their sums are, to first order, the torques of all loads.
    """
    loaded = (robot.with_effects([*robot.effects, load]) for load in _loads(robot))
    return [predict(one, at) - bodies for one in loaded]


def _loads(robot: Robot) -> list[Effect]:
    """Return effects that add masses on the last links: at places of a chain, else by mass and centre of each tip."""
    places = [dict(zip(("x_m", "y_m", "z_m"), place, strict=True)) for place in _PLACES]
    if robot.is_chain:
        return [Effect(LOAD, None, {"mass_kg": 1.0, **place}) for place in places]
    out = []
    for axis in tips(robot):
        out.append(Effect(LINK_MASS, axis, {"relative_change": 1.0}))
        out += [Effect(LINK_COM, axis, shift) for shift in places[1:]]
    return out


def _left(torque: Array, columns: Array) -> float:
    """Return the squared error on either half by a fit to the other half [Nm^2]."""
    middle = len(torque) // 2
    halves = [(torque[part], columns[part]) for part in (slice(middle), slice(middle, None))]
    left = 0.0
    for (y, x), (held_y, held_x) in zip(halves, halves[::-1], strict=True):
        factors = np.linalg.lstsq(x, y, rcond=None)[0]
        left += float(((held_y - held_x @ factors) ** 2).sum())
    return left
