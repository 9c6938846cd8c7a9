"""What the deflection of gears adds to the torque that rigid ones predict, far below the first mode.

A gear gives way by the torque of its joint over its stiffness, and what is behind it moves by as much less than
the motor: of one mass by ``(f / f0)^2`` more at the frequency ``f`` of a motion, a ninth at a third of the
mode. That again bends it by as much more: two steps leave a part of order six, 0.14 % there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.signals.motion import Motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.robot import Robot

Array = NDArray[np.float64]

# More would swing: what an octave above the low-pass is left of a motion may lie above the mode.
_STEPS = 2


def deflection_torque(robot: Robot, at: Motion, sample_time_s: float) -> Array:
    """Return the torque (n, n_axes) [Nm] along a motion of the motors that is of gears which give way.

    Of the robot as given, without damping of its gears; zero where all of them are rigid.
    """
    stiffness = _of_axes(robot, "stiffness")
    elastic = stiffness > 0
    if not elastic.any():
        return np.zeros_like(at[0])
    bare = robot.with_effects([])
    inertia, viscous = (_of_axes(bare, name) for name in ("motor_inertia", "viscous_friction"))
    position, velocity, acceleration, torque = at
    ratio = np.asarray(robot.gear_ratio)

    def torque_of(bent: Array) -> tuple[Array, Array]:
        """Return the torque of the motors (n, n_axes) [Nm] with gears bent by so much, and of what is behind them."""
        rate = np.gradient(bent, sample_time_s, axis=0, edge_order=2)
        curve = np.gradient(rate, sample_time_s, axis=0, edge_order=2)
        moved = (position - bent, velocity - rate, acceleration - curve, torque)
        behind = predicted_torque(bare, AS_GIVEN, moved)
        behind -= inertia * moved[2] + viscous * moved[1]
        return behind + inertia * acceleration + viscous * velocity, behind

    rigid, behind = torque_of(np.zeros_like(position))
    for _ in range(_STEPS):
        # Motor side: by how much less the joint moves.
        bent = np.divide(behind, ratio**2 * stiffness, out=np.zeros_like(behind), where=elastic)
        given_way, behind = torque_of(bent)
    return np.asarray(given_way - rigid)


def _of_axes(robot: Robot, quantity: str) -> Array:
    """Return a quantity of all axes (n_axes,), zero where an axis has none."""
    values = robot.parameters()
    names = [robot.axis_parameter(axis, quantity) for axis in robot.axis_numbers()]
    return np.array([0.0 if name is None else values[name] for name in names])
