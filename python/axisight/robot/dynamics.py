"""Rigid-body dynamics of a compiled robot, on a fixed or a floating base."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.errors import InputError, RobotError
from axisight.robot.base_motion import BaseMotion
from axisight.robot.description import Link

Array = NDArray[np.float64]


def joint_rows(n_joints: int, **arrays: ArrayLike) -> tuple[list[Array], bool]:
    """Return arrays as (n, n_joints), and whether all were (n_joints,); raise InputError for other shapes."""
    out = []
    single = True
    for name, value in arrays.items():
        x = np.asarray(value, dtype=np.float64)
        if x.ndim not in (1, 2) or x.shape[-1] != n_joints:
            raise InputError(
                f"{name}: expected shape ({n_joints},) or (n, {n_joints}), got {x.shape}"
            )
        single = single and x.ndim == 1
        out.append(np.ascontiguousarray(np.atleast_2d(x)))
    return out, single


def floating_base(core: _core.Robot) -> Link | None:
    """Return the link of a floating base; None for a fixed base."""
    found = _core.floating_base(core)
    return None if found is None else Link(found[0], np.array(found[1]), np.array(found[2]))


def coordinate_names(core: _core.Robot) -> list[str]:
    """Return the names of all coordinates: six of a floating base, then the joints."""
    base = list(_core.base_names()) if _core.floating_base(core) is not None else []
    return base + core.joint_names


def need_fixed_base(core: _core.Robot, what: str, advice: str) -> None:
    """Raise RobotError for a robot with a floating base; ``what`` needs a fixed one."""
    if _core.floating_base(core) is not None:
        raise RobotError(
            f"robot {core.name!r}: {what}: expected a fixed base, got a floating one; {advice}"
        )


def inertia_matrix(core: _core.Robot, q: ArrayLike) -> Array:
    """Return the inertia matrix in all coordinates; see `Robot.inertia_matrix`."""
    (rows,), single = joint_rows(core.n_joints, q=q)
    floats = _core.floating_base(core) is not None
    out = _core.floating_inertia(core, rows) if floats else core.inertia_matrix(rows)
    return out[0] if single else out


def bias(core: _core.Robot, q: ArrayLike, v: ArrayLike) -> Array:
    """Return Coriolis, centrifugal and gravity forces; see `Robot.bias`."""
    need_fixed_base(core, "bias", "use inverse_dynamics with a motion of the base")
    (rows, rates), single = joint_rows(core.n_joints, q=q, v=v)
    out = core.bias(rows, rates)
    return out[0] if single else out


def gravity(core: _core.Robot, q: ArrayLike) -> Array:
    """Return gravity forces; see `Robot.gravity`."""
    need_fixed_base(core, "gravity", "use inverse_dynamics with BaseMotion.at_rest")
    (rows,), single = joint_rows(core.n_joints, q=q)
    out = core.gravity(rows)
    return out[0] if single else out


def inverse_dynamics(
    core: _core.Robot, q: ArrayLike, v: ArrayLike, a: ArrayLike, base: BaseMotion | None
) -> Array:
    """Return forces in all coordinates; see `Robot.inverse_dynamics`."""
    (q, v, a), single = joint_rows(core.n_joints, q=q, v=v, a=a)
    moved = _base_of(core, base, len(q))
    if moved is None:
        out = core.inverse_dynamics(q, v, a)
        return out[0] if single else out
    q, v, a = (_repeated(x, len(moved)) for x in (q, v, a))
    parts = np.ascontiguousarray(np.hstack(moved.parts()))
    out = _core.floating_inverse_dynamics(core, q, v, a, parts)
    return out[0] if single and base is not None and base.is_single else out


def forward_dynamics(
    core: _core.Robot, q: ArrayLike, v: ArrayLike, tau: ArrayLike, base: BaseMotion | None
) -> Array:
    """Return accelerations in all coordinates; see `Robot.forward_dynamics`."""
    (q, v), single = joint_rows(core.n_joints, q=q, v=v)
    moved = _base_of(core, base, len(q))
    if moved is None:
        (tau,), alone = joint_rows(core.n_joints, tau=tau)
        out = core.forward_dynamics(q, v, tau)
        return out[0] if single and alone else out
    forces = np.asarray(tau, dtype=np.float64)
    if forces.shape[-1:] == (core.n_joints,):
        # No wrench acts on the base.
        forces = np.concatenate([np.zeros((*forces.shape[:-1], 6)), forces], axis=-1)
    (forces,), alone = joint_rows(core.n_joints + 6, tau=forces)
    count = max(len(q), len(moved), len(forces))
    q, v, forces, rate = (_repeated(x, count) for x in (q, v, forces, moved.parts()[0]))
    out = _core.floating_forward_dynamics(core, q, v, forces, rate)
    return out[0] if single and alone and base is not None and base.is_single else out


def _base_of(core: _core.Robot, base: BaseMotion | None, count: int) -> BaseMotion | None:
    """Return a motion of the base with ``count`` rows; None for a fixed base."""
    floats = _core.floating_base(core) is not None
    if not floats and base is None:
        return None
    if not floats:
        raise InputError(f"base: expected none, as the base of {core.name!r} is fixed")
    if not isinstance(base, BaseMotion):
        raise InputError(
            f"base: expected a BaseMotion, as the base of {core.name!r} floats, got {base!r}"
        )
    if len(base) not in (1, count) and count != 1:
        raise InputError(f"base: expected {count} rows as q, got {len(base)}")
    return BaseMotion(*(_repeated(x, max(count, len(base))) for x in base.parts()))


def _repeated(x: Array, count: int) -> Array:
    """Return an array with ``count`` rows; a single row is repeated."""
    return np.ascontiguousarray(np.broadcast_to(x, (count, x.shape[1])) if len(x) == 1 else x)
