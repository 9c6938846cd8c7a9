"""Finds axes with a wrong sign from their friction, which must take energy.

On an axis with little load the torque is mostly friction. If the simulator has none, comparing torques shows no
sign. Energy does: the motor's work beyond that on the simulator's bodies must become heat.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import Motion
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Net work, as a share of all work in either direction, below which friction seems to drive. An unknown load that a
# log lowers also gives a negative share, as large as the share of gravity that the load adds; 30 % does not reach
# the limit.
_DRIVES = -0.5


def check_passive(robot: Robot, log: Log, at: Motion) -> list[Finding]:
    """Return findings about axes whose friction seems to drive; ``at``: low-passed motion and torque."""
    bodies = predict(_without_friction(robot), at)
    power = (at[3] - bodies) * at[1]
    scale = np.abs(at[3] * at[1]).sum(axis=0)
    share = power.sum(axis=0) / np.maximum(scale, 1e-300)
    out = []
    for axis in np.flatnonzero(share < _DRIVES).tolist():
        message = (
            f"expected friction that brakes, got friction that drives the axis ({100 * share[axis]:.3g} % of the "
            "work done). Change the sign of its torque or of its position"
        )
        column = f"torque_cmd_{axis + 1}"
        out.append(Finding("sign_flipped", "refuse", message, log.name, axis + 1, column))
    return out


def _without_friction(robot: Robot) -> Robot:
    names = [name for name in robot.parameters() if name.endswith(".viscous_friction")]
    return robot.with_effects([]).with_parameters(dict.fromkeys(names, 0.0))
