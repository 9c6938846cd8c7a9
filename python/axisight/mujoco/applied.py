"""Effects as generalised forces of a MuJoCo simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.effects import Effect
from axisight.errors import InputError, MissingExtraError
from axisight.mujoco.end_of_step import torque_at_end
from axisight.mujoco.torques import EffectTorques, check_applicable

Array = NDArray[np.float64]

_ROUNDING = 1e-12


def apply(
    model: Any,
    data: Any,
    effects: Sequence[Effect],
    joints: Sequence[str] | None = None,
    *,
    gear_ratio: ArrayLike = 1.0,
) -> Array:
    """Set ``data.qfrc_applied`` of joints to what effects add there, and return it (n_axes,) [Nm or N].

    To be called at every step, in ``mujoco.set_mjcb_control`` or between ``mj_step1`` and ``mj_step2``, after
    ``data.ctrl`` is set. Entries of joints that no effect acts on stay; forces of your own on the others are
    added after the call. Torques are those at the speed at the end of the step, so that dry friction stops a
    joint and does not shake it.

    Parameters
    ----------
    model, data : ``mujoco.MjModel`` and ``mujoco.MjData``.
    effects : effects on single axes that are torques of the joint's angle, speed, load and command: friction
        laws, ripple, springs, gravity compensation, what the drive makes of the command. Parameters are
        those of the motor. The causes of a diagnosis that a model file had no place for are
        ``Written.remaining``. The load is what arm and gravity ask of the gear, by the acceleration of the
        last step.
    joints : names of the joints in the order of the axes; by default all that turn or slide, in the order of
        the model.
    gear_ratio : joint angle per motor angle, one or (n_axes,); by default motors are on the joints.

    Raises InputError for effects that act inside gears, on sensors, controllers or masses, between axes, or
    have a memory; for joints that are not there; and for data without positions (``mj_forward``).
    MissingExtraError without MuJoCo, ConvergenceError where a step is too long.

    """
    mujoco = _mujoco()
    axes = _axes(model, data, joints)
    ratio = np.asarray(gear_ratio, np.float64)
    if ratio.shape not in ((), axes.dofs.shape):
        raise InputError(
            f"gear_ratio: expected one, or one of each of {len(axes.dofs)} joints, got shape {ratio.shape}"
        )
    ratio = np.broadcast_to(ratio, axes.dofs.shape)
    torques = _torques(tuple(effects), tuple(ratio.tolist()))
    acting = [i for i in range(len(axes.dofs)) if any(e.axis == i + 1 for e in effects)]
    dofs = axes.dofs[acting]
    data.qfrc_applied[dofs] = 0.0
    if not acting:
        return np.zeros(len(axes.dofs))
    load = _load(mujoco, model, data)[axes.dofs]
    mujoco.mj_fwdActuation(model, data)
    command = data.qfrc_actuator[axes.dofs] * ratio
    of_command = torques.of_command(command)
    data.qfrc_applied[dofs] = of_command[acting]
    mujoco.mj_fwdAcceleration(model, data)
    step = model.opt.timestep
    free = data.qvel[axes.dofs] + step * data.qacc_smooth[axes.dofs]
    angle = data.qpos[axes.places]
    found = torque_at_end(
        lambda speeds: torques(angle, speeds, load, command),
        free,
        step * _mobility(mujoco, model, data, axes.dofs),
        _ROUNDING * float(np.abs(load).max() + np.abs(command / ratio).max()),
    )
    out = np.asarray(found + of_command)
    data.qfrc_applied[dofs] = out[acting]
    return out


@dataclass(frozen=True)
class _Axes:
    """Where the joints of axes stand in positions and in speeds, (n_axes,)."""

    places: NDArray[np.int64]
    dofs: NDArray[np.int64]


def _axes(model: Any, data: Any, joints: Sequence[str] | None) -> _Axes:
    mujoco = _mujoco()
    kinds = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    single = {model.joint(i).name: i for i in range(model.njnt) if model.jnt_type[i] in kinds}
    if joints is None:
        found = [i for i in range(model.njnt) if model.jnt_type[i] in kinds]
    else:
        for name in joints:
            if name not in single:
                raise InputError(
                    f"joints: expected hinge and slide joints of the model, {', '.join(single)}, got {name!r}"
                )
        found = [single[name] for name in joints]
    if not found:
        raise InputError("joints: expected at least one hinge or slide joint, got none")
    if not np.any(data.crb):
        raise InputError("data: expected positions that were computed (mj_forward), got none")
    return _Axes(model.jnt_qposadr[found].astype(int), model.jnt_dofadr[found].astype(int))


@lru_cache(maxsize=64)
def _torques(effects: tuple[Effect, ...], ratio: tuple[float, ...]) -> EffectTorques:
    """Return what is made once of effects that are asked for at every step."""
    if not all(np.isfinite(r) and r != 0 for r in ratio):
        raise InputError(f"gear_ratio: expected numbers other than zero, got {list(ratio)}")
    check_applicable(effects, len(ratio))
    return EffectTorques(effects, ratio)


def _load(mujoco: Any, model: Any, data: Any) -> Array:
    """Return what the arm asks of its gears (nv,) [Nm]: inertia and weight, less springs and rotors."""
    inertia = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, inertia, data.qacc)
    rotors = model.dof_armature * data.qacc
    return np.asarray(inertia - rotors + data.qfrc_bias - data.qfrc_spring)


def _mobility(mujoco: Any, model: Any, data: Any, dofs: NDArray[np.int64]) -> Array:
    """Return the accelerations of joints by torques on them (n_axes, n_axes) [rad/s^2/Nm]."""
    pushes = np.zeros((len(dofs), model.nv))
    pushes[np.arange(len(dofs)), dofs] = 1.0
    moves = np.zeros_like(pushes)
    mujoco.mj_solveM(model, data, moves, pushes)
    return moves[:, dofs].T


def _mujoco() -> Any:
    try:
        return import_module("mujoco")
    except ImportError as error:
        raise MissingExtraError(
            "axisight.mujoco needs MuJoCo: pip install 'axisight[mujoco]'"
        ) from error
