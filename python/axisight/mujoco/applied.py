"""Effects as generalized forces of a MuJoCo simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.mujoco.actuators import commanded_forces
from axisight.mujoco.dynamics import gear_load, library, moves_of
from axisight.mujoco.end_of_step import torque_at_end
from axisight.mujoco.gears import Gear
from axisight.mujoco.joints import Axes, axes_of, springs_of
from axisight.mujoco.torques import EffectTorques, acts_in_gear, check_applicable
from axisight.robot.axis_names import effect_on

Array = NDArray[np.float64]

_ROUNDING = 1e-12


def apply(
    model: Any,
    data: Any,
    effects: Sequence[Effect],
    joints: Sequence[str] | None = None,
    *,
    gear_ratio: ArrayLike = 1.0,
    gears: Mapping[str, str] | None = None,
) -> Array:
    """Set ``data.qfrc_applied`` of joints to the torques of the effects; return them (n_axes,) [Nm or N].

    Call this at every step, in ``mujoco.set_mjcb_control`` or between ``mj_step1`` and ``mj_step2``, after
    setting ``data.ctrl``. Entries of joints without effects stay. Add your own forces on the other joints
    after the call. Torques are those at the speed at the end of the step, so that dry friction stops a joint
    instead of shaking it. Gear springs are evaluated at the start of the step.

    Parameters
    ----------
    model, data : ``mujoco.MjModel`` and ``mujoco.MjData``.
    effects : effects on single axes whose torque depends on the joint's angle, speed, load and command:
        friction laws, ripple, springs, gravity compensation, changes of the drive's torque. Also effects
        inside gears (backlash, hysteresis, stiffness, transmission error) if ``gears`` names the gear.
        Parameters are motor side. ``Written.remaining`` holds the causes of a diagnosis that a model file
        cannot express. The load is the gear torque that arm and gravity require, with the acceleration of the
        last step.
    joints : names of the motors' joints in the order of the axes; by default all hinge and slide joints of
        the model that are not gears.
    gear_ratio : joint angle per motor angle, one or (n_axes,); by default motors are on the joints.
    gears : maps a joint behind an elastic gear to the joint that is the gear's spring. The spring has
        stiffness and damping, and its angle is the arm's minus the motor's. A gear with memory (hysteresis)
        keeps it in the last entries of ``data.userdata``, from rest at the first call. Pass all effects on
        gears in one call.

    Raises InputError

    - for effects inside gears that are not named, on sensors, controllers or masses, between axes, or with
      memory outside gears,
    - for unknown joints,
    - for data without positions (call ``mj_forward``).

    Raises MissingExtraError without MuJoCo, ConvergenceError if the time step is too long.

    """
    mujoco = library()
    axes = axes_of(mujoco, model, data, joints, gears or {})
    ratio = np.asarray(gear_ratio, np.float64)
    if ratio.shape not in ((), axes.dofs.shape):
        raise InputError(
            f"gear_ratio: expected one, or one of each of {len(axes.dofs)} joints, got shape {ratio.shape}"
        )
    ratio = np.broadcast_to(ratio, axes.dofs.shape)
    effects = [_placed(model, axes, effect) for effect in effects]
    torques, inside = _torques(tuple(effects), tuple(ratio.tolist()), springs_of(model, axes))
    acting = [i for i in range(len(axes.dofs)) if any(e.axis == i + 1 for e in effects)]
    dofs = axes.dofs[acting]
    data.qfrc_applied[dofs] = 0.0
    if not acting:
        return np.zeros(len(axes.dofs))
    in_gears = _in_gears(mujoco, model, data, axes, inside, data.qvel)
    load = gear_load(mujoco, model, data)[axes.dofs]
    mujoco.mj_fwdActuation(model, data)
    command = commanded_forces(model, data)[axes.dofs] * ratio
    known = torques.of_command(command) + in_gears
    data.qfrc_applied[dofs] = known[acting]
    mujoco.mj_fwdAcceleration(model, data)
    step = model.opt.timestep
    free = data.qvel + step * data.qacc_smooth
    angle = data.qpos[axes.places]
    moves = step * moves_of(mujoco, model, data, axes.dofs)
    found = torque_at_end(
        lambda speeds: torques(angle, speeds, load, command),
        free[axes.dofs],
        moves[:, axes.dofs].T,
        _ROUNDING * float(np.abs(load).max() + np.abs(command / ratio).max()),
    )
    # MuJoCo damps springs with the speed at the end of the step; effects that reduce damping must use the
    # same speed.
    at_end = _in_gears(mujoco, model, data, axes, inside, free + found @ moves)
    out = np.asarray(found + known - in_gears + at_end)
    data.qfrc_applied[dofs] = out[acting]
    return out


def _placed(model: Any, axes: Axes, effect: Effect) -> Effect:
    """Return an effect with the number of its axis instead of the joint's name."""
    if not effect.joints:
        return effect
    names = [model.joint(int(model.dof_jntid[dof])).name for dof in axes.dofs]
    return effect_on(effect, names)


@lru_cache(maxsize=64)
def _torques(
    effects: tuple[Effect, ...],
    ratio: tuple[float, ...],
    springs: tuple[tuple[int, float, float], ...],
) -> tuple[EffectTorques, dict[int, Gear]]:
    """Return the reusable part of effects that are evaluated at every step, and the gears by axis.

    ``springs``: axis, stiffness [Nm/rad] and damping [Nm s/rad] of each gear.
    """
    if not all(np.isfinite(r) and r != 0 for r in ratio):
        raise InputError(f"gear_ratio: expected numbers other than zero, got {list(ratio)}")
    check_applicable(effects, len(ratio), [axis + 1 for axis, _, _ in springs])
    inside = [effect for effect in effects if acts_in_gear(effect)]
    gears = {}
    for axis, stiffness, damping in springs:
        own = tuple(effect for effect in inside if effect.axis == axis + 1)
        if own:
            gears[axis] = Gear(own, ratio[axis], stiffness, damping)
    return EffectTorques([e for e in effects if e not in inside], ratio), gears


def _in_gears(
    mujoco: Any, model: Any, data: Any, axes: Axes, gears: Mapping[int, Gear], speeds: Array
) -> Array:
    """Apply the effects inside gears to their springs; return their torques on the motors (n_axes,) [Nm].

    ``speeds`` (nv,) [rad/s].
    """
    out = np.zeros(len(axes.dofs))
    kept = _kept(mujoco, model, data, list(gears.values()))
    for axis, gear in gears.items():
        place, dof = axes.springs[axis]
        speed = speeds[[axes.dofs[axis], dof]]
        at = data.qpos[[axes.places[axis], place]] - [0.0, model.qpos_spring[place]]
        own, kept = np.split(kept, [gear.n_kept])
        remembered = gear.remember(own, data.time, at) if gear.n_kept else own
        out[axis], data.qfrc_applied[dof] = gear.torques(at, speed, remembered)
    return out


def _kept(mujoco: Any, model: Any, data: Any, gears: Sequence[Gear]) -> Array:
    """Return the memory of the gears, a view into the data."""
    need = sum(gear.n_kept for gear in gears)
    if not need:
        return np.zeros(0)
    if model.nuserdata < need:
        raise InputError(
            f'model: expected room for what gears remember, <size nuserdata="{need}"/>, got {model.nuserdata}'
        )
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise InputError(
            "model: expected an integrator that asks once a step for what gears remember, Euler or implicit, "
            "got RK4"
        )
    return np.asarray(data.userdata[model.nuserdata - need :])
