"""What a MuJoCo model says of its motion: loads of gears, and accelerations by torques."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import MissingExtraError

Array = NDArray[np.float64]


def gear_load(mujoco: Any, model: Any, data: Any) -> Array:
    """Return the torque that the arm requires of its gears (nv,) [Nm], without springs and rotors."""
    inertia = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, inertia, data.qacc)
    rotors = model.dof_armature * data.qacc
    return np.asarray(inertia - rotors + data.qfrc_bias - data.qfrc_spring)


def moves_of(mujoco: Any, model: Any, data: Any, dofs: NDArray[np.int64]) -> Array:
    """Return the accelerations by torques on joints (n_axes, nv) [rad/s^2/Nm]."""
    pushes = np.zeros((len(dofs), model.nv))
    pushes[np.arange(len(dofs)), dofs] = 1.0
    moves = np.zeros_like(pushes)
    mujoco.mj_solveM(model, data, moves, pushes)
    return moves


def library() -> Any:
    """Return the module MuJoCo; raises MissingExtraError where it is not installed."""
    try:
        return import_module("mujoco")
    except ImportError as error:
        raise MissingExtraError(
            "axisight.mujoco needs MuJoCo: pip install 'axisight[mujoco]'"
        ) from error
