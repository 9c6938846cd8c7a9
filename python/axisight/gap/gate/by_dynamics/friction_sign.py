"""Friction takes energy: an axis whose friction would drive has a column with the wrong sign.

On an axis that carries little load the torque is mostly friction, of which a simulator may have none;
then no comparison with it shows a sign. Energy does: what the motor puts in beyond what the simulator's
bodies take is heat.
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

# Net work as a share of all the work done either way. An unknown load that a log raises or lowers
# shows here too, but as a share of the gravity it adds; three tenths of payload stay below this.
_DRIVES = -0.5


def check_passive(robot: Robot, log: Log, at: Motion) -> list[Finding]:
    """Return findings about axes on which friction would drive; motion and torque as low-passed."""
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
