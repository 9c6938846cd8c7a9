"""Measurements for a calibration, and their residuals for a geometry."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.calibration.geometry import (
    Array,
    Errors,
    left_jacobian,
    real,
    refuse_no_rotation,
)
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.robot import Robot


@summarized
@dataclass(frozen=True, eq=False)
class Positions:
    """Absolute positions of the target, for example from a laser tracker.

    ``joint_angle_rad`` (n, n_axes) are the angles r phi of the driven joints. ``position_m`` (n, 3)
    is in the frame of the device, and ``std_m`` is the standard deviation of a coordinate [m].
    ``payload_kg`` is one mass or (n,) masses at the load's centre (see :class:`Loads`).
    """

    joint_angle_rad: ArrayLike
    position_m: ArrayLike
    std_m: float = 1e-4
    payload_kg: ArrayLike = 0.0


@summarized
@dataclass(frozen=True, eq=False)
class Poses:
    """Absolute poses of the target: ``position_m`` (n, 3) and ``rotation`` (n, 3, 3).

    ``std_rad`` is the standard deviation of a component of the rotation vector [rad]. All other fields
    are those of :class:`Positions`.
    """

    joint_angle_rad: ArrayLike
    position_m: ArrayLike
    rotation: ArrayLike
    std_m: float = 1e-4
    std_rad: float = 1e-4
    payload_kg: ArrayLike = 0.0


@summarized
@dataclass(frozen=True, eq=False)
class Distances:
    """Distances between two positions of the target, for example from a ball bar or a scale.

    ``joint_angle_rad`` (n, 2, n_axes) holds both configurations. ``distance_m`` (n,) is the distance
    between both positions. ``std_m`` [m] and ``payload_kg`` are those of :class:`Positions`.
    """

    joint_angle_rad: ArrayLike
    distance_m: ArrayLike
    std_m: float = 1e-4
    payload_kg: ArrayLike = 0.0


@summarized
@dataclass(frozen=True, eq=False)
class SamePoint:
    """Configurations in which the target was at the same, unknown point.

    ``joint_angle_rad`` is (n, n_axes). ``point`` (n,) are whole numbers, equal for configurations at
    the same point, each at least twice. ``std_m`` is the standard deviation of a coordinate [m] of
    the target about its point. ``payload_kg`` is that of :class:`Positions`.
    """

    joint_angle_rad: ArrayLike
    point: ArrayLike
    std_m: float = 1e-4
    payload_kg: ArrayLike = 0.0


Measurement: TypeAlias = Positions | Poses | Distances | SamePoint


@summarized
@dataclass(frozen=True)
class Loads:
    """Loads that the joints hold during the measurements.

    gravity
        Whether the joints carry the weight of the links of the description.
    payload_com_m
        Centre of mass of ``payload_kg`` in the frame of the last link [m].
    """

    gravity: bool = True
    payload_com_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Checked:
    """A measurement with its arrays checked; angles flattened to (m, n_axes)."""

    kind: str
    angle: Array
    torque: Array
    target: Array
    rotation: Array
    std: tuple[float, float]

    def take(self, rows: NDArray[np.int64]) -> Checked:
        """Return the given rows, without points that then have one member and tell nothing."""
        ends = (2 * rows[:, None] + np.arange(2)).ravel() if self.kind == "distance" else rows
        part = replace(
            self,
            angle=self.angle[ends],
            torque=self.torque[ends],
            target=self.target[rows],
            rotation=self.rotation[rows],
        )
        if self.kind != "same_point":
            return part
        _, which, count = np.unique(part.target, return_inverse=True, return_counts=True)
        keep = np.flatnonzero(count[which] > 1)
        return part if len(keep) == len(rows) else part.take(keep)

    @property
    def rows(self) -> int:
        """Number of measurements."""
        return len(self.target)

    @property
    def freedom(self) -> int:
        """Number of independent measured numbers."""
        if self.kind == "same_point":
            return 3 * (self.rows - len(np.unique(self.target)))
        return self.rows * {"position": 3, "pose": 6, "distance": 1}[self.kind]

    def residual(self, errors: Errors, theta: Array) -> tuple[Array, Array]:
        """Return (model - measurement) / standard deviation, and its derivatives."""
        chain, jacobian = errors.jacobian(theta, self.angle, self.torque)
        place, by_place = chain.tool_position, jacobian[:, :3]
        p = jacobian.shape[2]
        if self.kind == "distance":
            apart = place[::2] - place[1::2]
            size = np.linalg.norm(apart, axis=1)
            slope = by_place[::2] - by_place[1::2]
            unit = apart / np.maximum(size, np.finfo(np.float64).tiny)[:, None]
            return (size - self.target) / self.std[0], np.einsum(
                "ni,nip->np", unit, slope
            ) / self.std[0]
        if self.kind == "same_point":
            mean = self._means()
            off, slope = place - mean @ place, by_place - np.tensordot(mean, by_place, 1)
            return (off / self.std[0]).ravel(), (slope / self.std[0]).reshape(-1, p)
        off = (place - self.target) / self.std[0]
        slope = by_place / self.std[0]
        if self.kind == "position":
            return off.ravel(), slope.reshape(-1, p)
        turn = scipy.spatial.transform.Rotation.from_matrix(
            chain.tool_rotation @ np.swapaxes(self.rotation, 1, 2)
        ).as_rotvec()
        by_turn = np.linalg.solve(left_jacobian(turn), jacobian[:, 3:])
        both = np.concatenate([off, turn / self.std[1]], axis=1)
        return both.ravel(), np.concatenate([slope, by_turn / self.std[1]], axis=1).reshape(-1, p)

    def _means(self) -> Array:
        """Return the matrix (n, n) that replaces each row by the mean over its point.

        The unknown points enter linearly, so the residual for the best points is the deviation
        from the mean.
        """
        _, which = np.unique(self.target, return_inverse=True)
        same = which[:, None] == which
        return np.asarray(same / same.sum(axis=1), dtype=np.float64)


def check(measurement: Measurement, robot: Robot, loads: Loads, where: str) -> Checked:
    """Return the measurement with arrays checked; error messages begin with ``where``."""
    kinds = {Positions: "position", Poses: "pose", Distances: "distance", SamePoint: "same_point"}
    kind = kinds.get(type(measurement))
    if kind is None:
        raise InputError(
            f"{where}: expected Positions, Poses, Distances or SamePoint, "
            f"got {type(measurement).__name__}"
        )
    angle = real(f"{where}.joint_angle_rad", measurement.joint_angle_rad)
    shape = (2, robot.n_axes) if kind == "distance" else (robot.n_axes,)
    if angle.shape[1:] != shape or not len(angle):
        wanted = ", ".join(str(s) for s in ("n", *shape))
        raise InputError(f"{where}.joint_angle_rad: expected shape ({wanted}), got {angle.shape}")
    n = len(angle)
    flat = angle.reshape(-1, robot.n_axes)
    payload = real(f"{where}.payload_kg", measurement.payload_kg)
    if payload.shape not in {(), (n,)} or np.any(payload < 0):
        raise InputError(
            f"{where}.payload_kg: expected one number or ({n},), none negative, "
            f"got shape {payload.shape}"
        )
    mass = np.repeat(np.broadcast_to(payload, (n,)), len(flat) // n)
    std = [_positive(f"{where}.std_m", measurement.std_m), 1.0]
    rotation = np.zeros((n, 0))
    if isinstance(measurement, Poses):
        std[1] = _positive(f"{where}.std_rad", measurement.std_rad)
        rotation = _shaped(f"{where}.rotation", measurement.rotation, (n, 3, 3))
        refuse_no_rotation(f"{where}.rotation", rotation)
    return Checked(
        kind,
        flat,
        load_torque(robot, flat, mass, loads),
        _target(measurement, n, where),
        rotation,
        (std[0], std[1]),
    )


def _target(measurement: Measurement, n: int, where: str) -> Array:
    if isinstance(measurement, Positions | Poses):
        return _shaped(f"{where}.position_m", measurement.position_m, (n, 3))
    if isinstance(measurement, Distances):
        target = _shaped(f"{where}.distance_m", measurement.distance_m, (n,))
        if np.any(target <= 0):
            raise InputError(f"{where}.distance_m: expected positive distances")
        return target
    point = _shaped(f"{where}.point", measurement.point, (n,))
    if np.any(point != np.round(point)):
        raise InputError(f"{where}.point: expected whole numbers")
    _, count = np.unique(point, return_counts=True)
    if np.any(count < 2):
        raise InputError(
            f"{where}.point: expected every point at least twice, got one that is met once"
        )
    return point


def load_torque(
    robot: Robot,
    joint_angle_rad: ArrayLike,
    payload_kg: ArrayLike = 0.0,
    loads: Loads | None = None,
) -> Array:
    """Return the torques (n, n_joints) [Nm] that the joints hold at rest.

    ``joint_angle_rad`` (n, n_axes) are the angles of the driven joints. ``payload_kg`` is one mass or
    (n,) masses, at the centre that ``loads`` gives; by default ``loads`` includes gravity on the
    links. Torques are those at the undeflected angles, with an error of second order in the
    deflection. Raises InputError for other shapes and values that are not finite.
    """
    held = loads or Loads()
    angle = real("joint_angle_rad", joint_angle_rad)
    if angle.ndim != 2 or angle.shape[1] != robot.n_axes or not len(angle):
        raise InputError(f"joint_angle_rad: expected shape (n, {robot.n_axes}), got {angle.shape}")
    payload = real("payload_kg", payload_kg)
    if payload.shape not in {(), (len(angle),)}:
        raise InputError(
            f"payload_kg: expected one number or ({len(angle)},), got shape {payload.shape}"
        )
    q = np.zeros((len(angle), robot.n_joints))
    q[:, robot.axis_joints] = angle
    torque = robot.gravity(q) if held.gravity else np.zeros_like(q)
    if np.any(payload):
        gravity = robot.gravity_m_s2
        point = real("loads.payload_com_m", held.payload_com_m)
        if point.shape != (3,):
            raise InputError(f"loads.payload_com_m: expected shape (3,), got {point.shape}")
        for row, mass in enumerate(np.broadcast_to(payload, (len(angle),))):
            lift = robot.jacobian(q[row], -1, tuple(point))[:3].T @ gravity
            torque[row] -= mass * lift
    return torque


def _shaped(field: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    array = real(field, value)
    if array.shape != shape:
        raise InputError(f"{field}: expected shape {shape}, got {array.shape}")
    return array


def _positive(field: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{field}: expected a positive number, got {value!r}")
    return float(value)
