"""Exact derivatives of a torque regressor with respect to the motion.

Every entry is a trigonometric polynomial of degree two in each revolute joint angle, because kinetic
energy is a square of first-degree terms. It is a polynomial of degree two in each prismatic position
and each velocity, and linear in the accelerations. A few shifted evaluations therefore give the
derivative without discretisation error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.display.summary import summarized
from axisight.rigid_body.regressor import TorqueModel

Array = NDArray[np.float64]

_TURNS = ((np.pi / 4.0, 1.0), (np.pi / 2.0, 0.5 * (1.0 - np.sqrt(2.0))))
"""Shifts s and weights c with ``f' = sum c (f(x + s) - f(x - s))``, exact for sin kx and cos kx
with k = 1 (2 sum c sin s = 1) and k = 2 (2 sum c sin 2 s = 2)."""


@summarized
@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Regressor (n, rows, p) and its derivatives with respect to the motion of driven joints.

    ``position``, ``velocity`` and ``acceleration`` are (n_axes, n, rows, p).
    """

    value: Array
    position: Array
    velocity: Array
    acceleration: Array


def regressor_sensitivity(model: TorqueModel, q: Array, v: Array, a: Array) -> Sensitivity:
    """Return the regressor of ``model`` and its derivatives, for motions (n, n_joints)."""
    joints = model.robot.axis_joints
    n, links = len(q), sum(column.extra is None for column in model.columns)
    # One call for all shifts: (block, sample, joint).
    shifts: list[tuple[int, int, float]] = []
    for joint, slides in zip(joints, model.robot.axis_is_prismatic, strict=True):
        for step in (1.0,) if slides else tuple(s for s, _ in _TURNS):
            shifts += [(0, joint, step), (0, joint, -step)]
        shifts += [(1, joint, 1.0), (1, joint, -1.0), (2, joint, 1.0)]
    motions = np.repeat(np.stack([q, v, a])[:, None], 1 + len(shifts), axis=1)
    for block, (kind, joint, step) in enumerate(shifts, 1):
        motions[kind, block, :, joint] += step
    flat = motions.reshape(3, -1, q.shape[1])
    out = _core.torque_regressor(
        model.robot.core, flat[0], flat[1], flat[2], rows=model.row_map, extras=[]
    ).reshape(1 + len(shifts), n, model.n_rows, links)
    shape = (len(joints), n, model.n_rows, model.n_parameters)
    by_position, by_velocity, by_acceleration = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    value = np.zeros(shape[1:])
    value[..., :links] = out[0]
    at = 1
    for k, slides in enumerate(model.robot.axis_is_prismatic):
        for weight in (0.5,) if slides else tuple(c for _, c in _TURNS):
            by_position[k, ..., :links] += weight * (out[at] - out[at + 1])
            at += 2
        by_velocity[k, ..., :links] = 0.5 * (out[at] - out[at + 1])
        by_acceleration[k, ..., :links] = out[at + 2] - out[0]
        at += 3
    for column, extra in enumerate(model.extras, links):
        signal, motion, rows, dead_band, smoothing = extra
        along, felt = np.array(motion), np.array(rows)
        level, slope = _signal(signal, (q @ along, v @ along, a @ along), dead_band, smoothing)
        value[..., column] = level[:, None] * felt
        into = {"position": by_position, "acceleration": by_acceleration}.get(signal, by_velocity)
        into[..., column] = along[joints, None, None] * slope[:, None] * felt
    return Sensitivity(value, by_position, by_velocity, by_acceleration)


def _signal(
    signal: str, motion: tuple[Array, Array, Array], dead_band: float, smoothing: float
) -> tuple[Array, Array]:
    """Return the value of an extra column and its slope, zero for a step."""
    position, velocity, acceleration = motion
    if signal == "constant":
        return np.ones_like(velocity), np.zeros_like(velocity)
    if signal != "direction":
        level = {"position": position, "velocity": velocity, "acceleration": acceleration}[signal]
        return level, np.ones_like(level)
    moving = np.abs(velocity) > dead_band
    if smoothing > 0.0:
        level = np.tanh(velocity / smoothing)
        return np.where(moving, level, 0.0), np.where(moving, (1.0 - level**2) / smoothing, 0.0)
    return np.where(moving, np.sign(velocity), 0.0), np.zeros_like(velocity)
