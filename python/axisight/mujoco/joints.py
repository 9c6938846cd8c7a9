"""Joints of a MuJoCo model that are axes or gear springs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError

# Relative difference up to which numbers of a model file count as equal.
_SAME = 1e-9


@dataclass(frozen=True)
class Axes:
    """Indices of the axes' joints in positions and speeds, (n_axes,), and the gear springs by axis."""

    places: NDArray[np.int64]
    dofs: NDArray[np.int64]
    springs: Mapping[int, tuple[int, int]]


def axes_of(
    mujoco: Any, model: Any, data: Any, joints: Sequence[str] | None, gears: Mapping[str, str]
) -> Axes:
    """Return the axes of named joints, or of all hinge and slide joints that are no springs of ``gears``.

    Raises InputError for unknown joints, for gears that are no springs, and for data without positions.
    """
    kinds = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    single = {model.joint(i).name: i for i in range(model.njnt) if model.jnt_type[i] in kinds}
    if joints is None:
        of_gears = {single.get(name) for name in gears.values()}
        found = [i for i in range(model.njnt) if model.jnt_type[i] in kinds and i not in of_gears]
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
    springs: dict[int, tuple[int, int]] = {}
    taken = set(found)
    for motor, spring in gears.items():
        if single.get(motor) not in found:
            named = ", ".join(model.joint(i).name for i in found)
            raise InputError(f"gears: expected joints of axes, {named}, got {motor!r}")
        joint = _spring(model, single, motor, spring, taken)
        taken.add(joint)
        springs[found.index(single[motor])] = _place(model, joint)
    return Axes(model.jnt_qposadr[found].astype(int), model.jnt_dofadr[found].astype(int), springs)


def springs_of(model: Any, axes: Axes) -> tuple[tuple[int, float, float], ...]:
    """Return axis, stiffness [Nm/rad] and damping [Nm s/rad] of every gear."""
    return tuple(
        (axis, float(model.jnt_stiffness[model.dof_jntid[dof]]), float(model.dof_damping[dof]))
        for axis, (_, dof) in axes.springs.items()
    )


def _spring(
    model: Any, single: Mapping[str, int], motor: str, name: str, taken: Collection[int]
) -> int:
    """Return the joint that is the spring of a gear; raises InputError for one in ``taken`` or unsuitable."""
    joint = single.get(name)
    like = "hinge or slide joint that is none of the axes', on the axis of the motor and with stiffness"
    if joint is None or joint in taken:
        raise InputError(f"gears: {motor}: expected a {like}, got {name!r}")
    if model.jnt_type[joint] != model.jnt_type[single[motor]]:
        raise InputError(f"gears: {motor}: expected a {like}, got {name!r}, of another kind")
    if not _coaxial(model, joint, single[motor]):
        raise InputError(f"gears: {motor}: expected a {like}, got {name!r}, which is elsewhere")
    if not model.jnt_stiffness[joint] > 0:
        raise InputError(
            f"gears: {motor}: expected a {like}, got {name!r} with {model.jnt_stiffness[joint]:g}"
        )
    return joint


def _coaxial(model: Any, one: int, other: int) -> bool:
    """Return whether two joints belong to one body and share their line."""
    same_body = model.jnt_bodyid[one] == model.jnt_bodyid[other]
    mine, its = (np.concatenate([model.jnt_axis[k], model.jnt_pos[k]]) for k in (one, other))
    return bool(same_body and np.abs(mine - its).max() < _SAME)


def _place(model: Any, joint: int) -> tuple[int, int]:
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
