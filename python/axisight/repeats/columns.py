"""Torques of the parameters that may differ between runs: friction, offset, inertia and load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.logs.log import AxisKind
from axisight.repeats.motions import RunMotions
from axisight.rigid_body.friction import USUAL_TERMS
from axisight.rigid_body.from_logs import joint_motion
from axisight.rigid_body.motion import MotionEstimate
from axisight.rigid_body.regressor import TorqueModel
from axisight.robot import Robot
from axisight.robot.fixed_base import refuse_floating

Array = NDArray[np.float64]

# A column of which the columns before it leave less than this share is not separate from them.
_SEPARATE = 0.05

# Quantity, its unit on a revolute and on a prismatic axis. The order is that in which columns are kept where a
# motion does not separate them.
_OF_AXIS = (
    ("torque_offset", "Nm", "N"),
    ("coulomb_friction", "Nm", "N"),
    ("viscous_friction", "Nm s/rad", "N s/m"),
    ("inertia", "kg m^2", "kg"),
    ("position_slope", "Nm/rad", "N/m"),
)
OF_AXIS = tuple(name for name, _, _ in _OF_AXIS)
"""Quantities of an axis; the other parameters are those of the last link."""
_FRICTION = OF_AXIS[:3]


@dataclass(frozen=True, eq=False)
class Columns:
    """The regression of every run: torque = matrix @ parameters + what all runs share.

    names, units, axis
        Of each parameter (n_parameters,); axis from 1.
    matrix
        (n_runs, n_samples, n_axes, n_parameters).
    torque
        (n_runs, n_samples, n_axes) [Nm], less the torque that the model explains in all runs alike.
    level
        (n_parameters,), the value in all runs together, to which the parameters of a run add.
    dropped
        Parameters that the motion does not separate from the others.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    axis: tuple[int, ...]
    matrix: Array
    torque: Array
    level: Array
    dropped: tuple[str, ...] = ()

    def kept(self, keep: Sequence[int]) -> Columns:
        """Return only some of the columns, by index."""
        return replace(
            self,
            names=tuple(self.names[i] for i in keep),
            units=tuple(self.units[i] for i in keep),
            axis=tuple(self.axis[i] for i in keep),
            matrix=self.matrix[..., list(keep)],
            level=self.level[list(keep)],
        )


def columns_of(motions: RunMotions, robot: Robot | None, kinds: Sequence[AxisKind]) -> Columns:
    """Return the columns of runs, with the mechanics of ``robot`` or for every axis alone.

    Without a robot an axis has an offset, Coulomb and viscous friction, an inertia and a torque in proportion
    to its position, the motor's. With a robot an axis has offset and friction, and the last link mass, first
    moments and inertias; other links and rotors are those of the file. ``kinds`` are those of the axes.
    Raises InputError for a robot with another number of axes.
    """
    found = _of_axes(motions, kinds) if robot is None else _of_robot(motions, robot)
    return _separate(found, motions.weight)


def unexplained(columns: Columns, weight: Array, torque_nm: Array) -> Array:
    """Return the rms torque (n_axes,) that the model leaves in all runs together, relative to ``torque_nm``.

    ``torque_nm`` is (n_axes,). NaN for axes without samples; ``weight`` is (n_samples, n_axes).
    """
    count = weight.sum(axis=0)
    left = np.mean(np.sum(columns.torque**2 * weight, axis=1), axis=0)
    share = np.sqrt(left / np.maximum(count, 1.0)) / torque_nm
    return np.where(count > 0, share, np.nan)


def _of_axes(motions: RunMotions, kinds: Sequence[AxisKind]) -> Columns:
    n_axes = motions.weight.shape[1]
    names, units, axes, parts = [], [], [], []
    for axis in motions.moving:
        for k, (quantity, turns, slides) in enumerate(_OF_AXIS):
            full = np.zeros((len(motions.runs), len(motions.weight), n_axes))
            full[:, :, axis] = [_signals(motion, int(axis))[k] for motion in motions.runs]
            parts.append(full)
            names.append(f"axis{axis + 1}.{quantity}")
            units.append(turns if kinds[axis] == "revolute" else slides)
            axes.append(int(axis) + 1)
    matrix, torque = np.stack(parts, axis=-1), motions.torque
    level = _common_fit(matrix, torque, motions.weight)
    return Columns(tuple(names), tuple(units), tuple(axes), matrix, torque - matrix @ level, level)


def _signals(motion: MotionEstimate, axis: int) -> list[Array]:
    """Return the columns of an axis (from 0), in the order of ``_OF_AXIS``."""
    q, v = motion.position_rad[:, axis], motion.velocity_rad_s[:, axis]
    return [np.ones_like(v), np.sign(v), v, motion.acceleration_rad_s2[:, axis], q - q.mean()]


def _common_fit(matrix: Array, torque: Array, weight: Array) -> Array:
    """Return the least-squares parameters of all runs together (n_parameters,)."""
    k = matrix.shape[-1]
    w = np.broadcast_to(weight, torque.shape)
    found = np.linalg.lstsq(
        (w[..., None] * matrix).reshape(-1, k), (w * torque).ravel(), rcond=None
    )
    return np.asarray(found[0], dtype=np.float64)


def _of_robot(motions: RunMotions, robot: Robot) -> Columns:
    n_runs, n, n_axes = motions.torque.shape
    if robot.n_axes != n_axes:
        raise InputError(f"robot: expected {n_axes} axes as the logs, got {robot.n_axes}")
    refuse_floating(robot, "the comparison of runs")
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    joint = [joint_motion(model, motion) for motion in motions.runs]
    q, v, a, torque = (np.concatenate(parts) for parts in zip(*joint, strict=True))
    keep = _may_change(model, motions)
    matrix = model.matrix(q, v, a)
    names = [model.names[i] for i in keep]
    drives = [i for i, name in zip(keep, names, strict=True) if _quantity(name) in _FRICTION]
    level = model.nominal.copy()
    level[[i for i, name in enumerate(model.names) if _quantity(name) in _FRICTION]] = 0.0
    rest = (torque - matrix @ level).reshape(n_runs, n, n_axes)
    own = matrix[..., drives].reshape(n_runs, n, n_axes, len(drives))
    level[drives] = _common_fit(own, rest, motions.weight)
    left = torque - matrix @ level
    return Columns(
        tuple(names),
        tuple(model.units[i] for i in keep),
        tuple(_axis_of(model, i) for i in keep),
        matrix[..., keep].reshape(n_runs, n, n_axes, len(keep)),
        left.reshape(n_runs, n, n_axes),
        level[keep],
    )


def _quantity(name: str) -> str:
    return name.rpartition(".")[2]


def _may_change(model: TorqueModel, motions: RunMotions) -> list[int]:
    """Return the parameters that may differ between runs: drives of axes that move, and the last link."""
    moving = {int(axis) + 1 for axis in motions.moving}
    order = {name: k for k, name in enumerate(_FRICTION)}
    drives = [
        (_axis_of(model, i), order[quantity], i)
        for i, name in enumerate(model.names)
        if (quantity := _quantity(name)) in order and _axis_of(model, i) in moving
    ]
    links = [i for i, column in enumerate(model.columns) if column.extra is None]
    last = model.names[links[-1]].rpartition(".")[0]
    load = [i for i in links if model.names[i].rpartition(".")[0] == last]
    return [i for _, _, i in sorted(drives)] + load


def _axis_of(model: TorqueModel, index: int) -> int:
    """Return the axis (from 1) that moves the joint of a parameter."""
    joints = model.robot.joint_names
    at = joints.index(model.names[index].rpartition(".")[0])
    return 1 + max(k for k, joint in enumerate(model.robot.axis_joints) if joint <= at)


def _separate(columns: Columns, weight: Array) -> Columns:
    """Return the columns that the motion of the first run tells apart, in their order."""
    k = columns.matrix.shape[3]
    size = np.sqrt(np.mean(columns.torque**2 * weight, axis=(0, 1)))
    scaled = weight / np.where(size > 0, size, 1.0)
    stack = (scaled[..., None] * columns.matrix[0]).reshape(-1, k)
    basis = np.zeros((len(stack), 0))
    keep, dropped = [], []
    for i in range(k):
        column = stack[:, i]
        left = column - basis @ (basis.T @ column)
        left = left - basis @ (basis.T @ left)
        whole, rest = np.linalg.norm(column), np.linalg.norm(left)
        if rest <= _SEPARATE * whole:
            if whole > 0:
                dropped.append(columns.names[i])
            continue
        keep.append(i)
        basis = np.column_stack([basis, left / rest])
    return replace(columns.kept(keep), dropped=tuple(dropped))
