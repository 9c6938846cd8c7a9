"""A modelled remainder as generalized forces of a MuJoCo simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError
from axisight.mujoco.dynamics import gear_load, library, moves_of
from axisight.mujoco.end_of_step import torque_at_end
from axisight.mujoco.joints import axes_of
from axisight.remainder import RunningRemainder

Array = NDArray[np.float64]

_ROUNDING = 1e-12


def apply_remainder(
    model: Any,
    data: Any,
    running: RunningRemainder,
    joints: Sequence[str] | None = None,
    *,
    gear_ratio: ArrayLike = 1.0,
    temperature_c: ArrayLike | None = None,
    beside_nm: ArrayLike = 0.0,
) -> Array:
    """Set ``data.qfrc_applied`` of joints to a modelled remainder; return its torques (n_axes,) [Nm or N].

    Call this once a step, as `apply`. The machine needs the remainder as additional motor torque, so it acts on the
    joints with the opposite sign. A torque that depends on the speed of its own axis is that at the end of the step.

    Parameters
    ----------
    model, data : ``mujoco.MjModel`` and ``mujoco.MjData``.
    running : the remainder, which remembers the last reversals; one for each run.
    joints : names of the motors' joints in the order of the axes; by default all hinge and slide joints.
    gear_ratio : joint angle per motor angle, one or (n_axes,); by default motors are on the joints.
    temperature_c : temperatures of the axes (n_axes,) [degC], if a term depends on them.
    beside_nm : torques (n_axes,) [Nm] that these joints have beside it, such as the result of `apply`.

    Raises InputError if joints are unknown, if their number is not that of the remainder's axes, and for data
    without positions. Raises MissingExtraError without MuJoCo, ConvergenceError if the time step is too long.

    """
    mujoco = library()
    axes = axes_of(mujoco, model, data, joints, {})
    n = running.remainder.n_axes
    if len(axes.dofs) != n:
        raise InputError(f"joints: expected {n}, one for each axis, got {len(axes.dofs)}")
    ratio, beside = (
        np.broadcast_to(np.asarray(x, np.float64), (n,)) for x in (gear_ratio, beside_nm)
    )
    if not np.all(np.isfinite(ratio)) or np.any(ratio == 0):
        raise InputError(f"gear_ratio: expected numbers other than zero, got {ratio.tolist()}")
    load = gear_load(mujoco, model, data)[axes.dofs]
    speed = data.qvel[axes.dofs]
    temperature = None if temperature_c is None else np.broadcast_to(temperature_c, (n,))
    now = running.at(
        float(data.time),
        data.qpos[axes.places] / ratio,
        speed / ratio,
        data.qacc[axes.dofs] / ratio,
        load * ratio,
        temperature,
    )
    data.qfrc_applied[axes.dofs] = beside
    mujoco.mj_fwdActuation(model, data)
    mujoco.mj_fwdAcceleration(model, data)
    step = model.opt.timestep
    free = (data.qvel + step * data.qacc_smooth)[axes.dofs]
    moves = step * moves_of(mujoco, model, data, axes.dofs)
    found = torque_at_end(
        lambda speeds: -running.with_own_speeds(now, speeds / ratio) / ratio,
        free,
        moves[:, axes.dofs].T,
        _ROUNDING * float(np.abs(load).max() + 1.0),
    )
    data.qfrc_applied[axes.dofs] = found + beside
    return found
