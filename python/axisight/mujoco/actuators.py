"""Actuators of a MuJoCo model that have commands, and those that have none."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Largest `mjtTrn` of an actuator that acts on a joint: in its frame, or in that of its parent.
ON_JOINT = 1


def places(model: Any) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the first command, the number of commands and the first output (n,) of each actuator.

    MuJoCo before 3.12 has one command and one output for each.
    """
    n = int(getattr(model, "nactuator", model.nu))
    first, every = np.arange(n), np.ones(n)
    names = ("actuator_ctrladr", "actuator_ctrlnum", "actuator_outadr")
    found = [
        np.asarray(getattr(model, name, usual), dtype=np.int64)
        for name, usual in zip(names, (first, every, first), strict=True)
    ]
    return found[0], found[1], found[2]


def commanded_forces(model: Any, data: Any) -> Array:
    """Return the generalized forces (nv,) of the actuators that have commands.

    Those without, such as passive `dcmotor` actuators, are no part of a motor's command.
    """
    _, count, output = places(model)
    forces = np.array(data.qfrc_actuator)
    for i in np.flatnonzero((count == 0) & (model.actuator_trntype <= ON_JOINT)).tolist():
        dof = model.jnt_dofadr[model.actuator_trnid[i, 0]]
        forces[dof] -= model.actuator_gear[output[i], 0] * data.actuator_force[output[i]]
    return forces
