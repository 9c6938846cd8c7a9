"""Geometry of a chain with its errors: forward kinematics and exact derivatives.

The map of Wernholt (2004), (4.1), gives the tool location as a function of joint variables and
parameters theta. Every joint has an origin, an axis, an offset and a compliance. A base frame
precedes the chain, and a tool frame follows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot.branches import refuse_branches

Array = NDArray[np.float64]

GROUPS = ("compliance", "offset", "tilt", "origin", "tool", "base")
"""Groups of parameters. A combination is named after its parameter in the earliest group."""


@summarized
@dataclass(frozen=True, eq=False)
class Geometry:
    """Geometry and joint compliance of a chain, in the frames of ``axisight.robot/1``.

    At zero angle the frame of every link is parallel to that of its parent.

    joint_names, driven, sliding
        For every joint, base to tip: name, whether a motor drives it, whether it slides.
    origin_m, axis
        (n_joints, 3), origin [m] and axis of every joint in its parent's frame; axes are unit vectors.
    offset_rad
        (n_joints,), added to the joint angle [rad or m]; zero for elastic joints.
    compliance_rad_nm
        (n_joints,), deflection per load torque [rad/Nm or m/N].
    base_rotation, base_position_m
        (3, 3) and (3,) [m], the robot's base in the frame of the measuring device.
    tool_rotation, tool_position_m
        (3, 3) and (3,) [m], the measured target in the frame of the last link.
    """

    joint_names: tuple[str, ...]
    driven: tuple[bool, ...]
    sliding: tuple[bool, ...]
    origin_m: Array
    axis: Array
    offset_rad: Array
    compliance_rad_nm: Array
    base_rotation: Array
    base_position_m: Array
    tool_rotation: Array
    tool_position_m: Array

    @property
    def n_joints(self) -> int:
        """Number of joints, driven and elastic."""
        return len(self.joint_names)

    @property
    def stiffness_nm_rad(self) -> Array:
        """(n_joints,), the inverse of the compliance; infinite for stiff joints."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.compliance_rad_nm, dtype=np.float64)

    def tool_location(
        self, joint_angle_rad: ArrayLike, torque_nm: ArrayLike | None = None
    ) -> tuple[Array, Array]:
        """Return rotations (n, 3, 3) and positions (n, 3) [m] of the target.

        ``joint_angle_rad`` (n, n_axes) are the angles r phi of the driven joints, before their
        springs. ``torque_nm`` (n, n_joints) are the torques [Nm] that the joints hold, zero by
        default. Raises InputError for other shapes and values that are not finite.
        """
        angle = _rows("joint_angle_rad", joint_angle_rad, sum(self.driven))
        load = (
            np.zeros((len(angle), self.n_joints))
            if torque_nm is None
            else _rows("torque_nm", torque_nm, self.n_joints)
        )
        if len(load) != len(angle):
            raise InputError(f"torque_nm: expected {len(angle)} rows, got {len(load)}")
        chain = walk(self, angle, load)
        return chain.tool_rotation, chain.tool_position


def nominal_geometry(
    robot: Robot,
    *,
    tool_position_m: ArrayLike = (0.0, 0.0, 0.0),
    tool_rotation: ArrayLike | None = None,
    base_position_m: ArrayLike = (0.0, 0.0, 0.0),
    base_rotation: ArrayLike | None = None,
) -> Geometry:
    """Return the geometry of a robot description, with the compliances of its springs.

    ``tool_position_m`` and ``tool_rotation`` place the target in the frame of the last link.
    ``base_position_m`` and ``base_rotation`` place the robot's base in the frame of the measuring
    device. Positions are (3,) [m]; rotations are (3, 3), the identity by default. Raises InputError
    naming the field, and RobotError for a robot with branches.
    """
    refuse_branches(robot, "the calibration of one tool")
    joints = robot.joints
    stiffness = [np.inf if joint.spring is None else joint.spring.stiffness for joint in joints]
    axis = np.array([joint.axis for joint in joints])
    return Geometry(
        joint_names=tuple(joint.name for joint in joints),
        driven=tuple(joint.drive is not None for joint in joints),
        sliding=tuple(joint.prismatic for joint in joints),
        origin_m=np.array([joint.origin_m for joint in joints]),
        axis=axis / np.linalg.norm(axis, axis=1)[:, None],
        offset_rad=np.zeros(len(joints)),
        compliance_rad_nm=1.0 / np.array(stiffness),
        base_rotation=_rotation("base_rotation", base_rotation),
        base_position_m=_vector("base_position_m", base_position_m),
        tool_rotation=_rotation("tool_rotation", tool_rotation),
        tool_position_m=_vector("tool_position_m", tool_position_m),
    )


@dataclass(frozen=True, eq=False)
class Chain:
    """Locations of all frames, for n configurations and j joints.

    ``angle`` (n, j); ``parent`` and ``link`` (n, j, 3, 3), rotations before and after a joint;
    ``origin`` (n, j, 3); ``tool_rotation`` (n, 3, 3); ``tool_position`` (n, 3).
    """

    angle: Array
    parent: Array
    link: Array
    origin: Array
    tool_rotation: Array
    tool_position: Array


def walk(geometry: Geometry, joint_angle: Array, torque: Array) -> Chain:
    """Return the locations of all frames; a torque turns its joint back by compliance times torque."""
    n, joints = len(joint_angle), geometry.n_joints
    angle = geometry.offset_rad - geometry.compliance_rad_nm * torque
    angle[:, np.array(geometry.driven)] += joint_angle
    rotation = np.broadcast_to(geometry.base_rotation, (n, 3, 3))
    position = np.broadcast_to(geometry.base_position_m, (n, 3))
    parent, link = np.empty((n, joints, 3, 3)), np.empty((n, joints, 3, 3))
    origin = np.empty((n, joints, 3))
    for j in range(joints):
        parent[:, j] = rotation
        position = position + rotation @ geometry.origin_m[j]
        origin[:, j] = position
        if geometry.sliding[j]:
            position = position + angle[:, j, None] * (rotation @ geometry.axis[j])
        else:
            rotation = rotation @ _turn(angle[:, j, None] * geometry.axis[j])
        link[:, j] = rotation
    return Chain(
        angle,
        parent,
        link,
        origin,
        rotation @ geometry.tool_rotation,
        position + rotation @ geometry.tool_position_m,
    )


@dataclass(frozen=True, eq=False)
class Errors:
    """Parameters theta: deviations from a nominal geometry.

    ``kinds`` are (group, joint, component) of every parameter, with joint -1 for frames; ``names``
    and ``units`` are theirs. ``tangents`` are the two directions in which each axis can tilt.
    """

    nominal: Geometry
    kinds: tuple[tuple[str, int, int], ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    tangents: Array

    def geometry(self, theta: Array) -> Geometry:
        """Return the geometry with deviations ``theta``."""
        g = self.nominal
        origin, offset = g.origin_m.copy(), g.offset_rad.copy()
        compliance, turn = g.compliance_rad_nm.copy(), np.zeros((g.n_joints, 3))
        frames = {"base": np.zeros(6), "tool": np.zeros(6)}
        for (group, joint, part), value in zip(self.kinds, theta, strict=True):
            if group == "origin":
                origin[joint, part] += value
            elif group == "tilt":
                turn[joint] += value * self.tangents[joint, part]
            elif group == "offset":
                offset[joint] += value
            elif group == "compliance":
                compliance[joint] += value
            else:
                frames[group][part] += value
        return replace(
            g,
            origin_m=origin,
            axis=np.einsum("jab,jb->ja", _turn(turn), g.axis),
            offset_rad=offset,
            compliance_rad_nm=compliance,
            base_position_m=g.base_position_m + frames["base"][:3],
            base_rotation=_turn(frames["base"][3:]) @ g.base_rotation,
            tool_position_m=g.tool_position_m + frames["tool"][:3],
            tool_rotation=_turn(frames["tool"][3:]) @ g.tool_rotation,
        )

    def jacobian(self, theta: Array, joint_angle: Array, torque: Array) -> tuple[Chain, Array]:
        """Return the chain and the derivatives (n, 6, p) of position, then rotation.

        A rotation's derivative is the vector w of ``dR = [w]x R``, in the measuring frame.
        """
        now = self.geometry(theta)
        chain = walk(now, joint_angle, torque)
        n = len(joint_angle)
        out = np.zeros((n, 6, len(self.kinds)))
        about = self._turning(theta)
        for k, (group, j, part) in enumerate(self.kinds):
            if group in {"base", "tool"}:
                _frame_column(out[:, :, k], now, chain, group, part, about[group])
            elif group == "origin":
                out[:, :3, k] = chain.parent[:, j, :, part]
            elif group == "tilt":
                delta = about[f"tilt{j}"] @ self.tangents[j, part]
                _tilt_column(out[:, :, k], now, chain, j, delta)
            else:
                rate = 1.0 if group == "offset" else -torque[:, j, None]
                along = rate * (chain.parent[:, j] @ now.axis[j])
                if now.sliding[j]:
                    out[:, :3, k] = along
                else:
                    out[:, :3, k] = np.cross(along, chain.tool_position - chain.origin[:, j])
                    out[:, 3:, k] = along
        return chain, out

    def _turning(self, theta: Array) -> dict[str, Array]:
        """Return the left Jacobians of the finite rotations in ``theta``."""
        turn: dict[str, Array] = {"base": np.zeros(3), "tool": np.zeros(3)}
        for (group, joint, part), value in zip(self.kinds, theta, strict=True):
            if group == "tilt":
                key = f"tilt{joint}"
                turn[key] = turn.get(key, np.zeros(3)) + value * self.tangents[joint, part]
            elif group in turn and part >= 3:
                turn[group][part - 3] += value
        return {key: left_jacobian(vector) for key, vector in turn.items()}


def _frame_column(
    out: Array, now: Geometry, chain: Chain, group: str, part: int, about: Array
) -> None:
    if group == "base":
        if part < 3:
            out[:, part] = 1.0
        else:
            w = about[:, part - 3]
            out[:, :3] = np.cross(w, chain.tool_position - now.base_position_m)
            out[:, 3:] = w
    elif part < 3:
        out[:, :3] = chain.link[:, -1, :, part]
    else:
        out[:, 3:] = chain.link[:, -1] @ about[:, part - 3]


def _tilt_column(out: Array, now: Geometry, chain: Chain, j: int, delta: Array) -> None:
    """Write the derivative by a tilt, which turns the joint's motion but not its frame at zero angle."""
    if now.sliding[j]:
        out[:, :3] = chain.angle[:, j, None] * (chain.parent[:, j] @ np.cross(delta, now.axis[j]))
        return
    w = (chain.parent[:, j] - chain.link[:, j]) @ delta
    out[:, :3] = np.cross(w, chain.tool_position - chain.origin[:, j])
    out[:, 3:] = w


def errors_about(nominal: Geometry, groups: Sequence[str], *, rotation: bool) -> Errors:
    """Return the parameters of ``groups``; tool rotations only if ``rotation`` is measured."""
    tangents, labels = _tangents(nominal.axis)
    kinds: list[tuple[str, int, int]] = []
    names: list[str] = []
    units: list[str] = []

    def add(group: str, joint: int, part: int, name: str, unit: str) -> None:
        kinds.append((group, joint, part))
        names.append(name)
        units.append(unit)

    for group in (g for g in GROUPS if g in groups):
        if group in {"base", "tool"}:
            for part in range(6 if group == "base" or rotation else 3):
                what = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")[part]
                add(group, -1, part, f"{group}.{what}", "m" if part < 3 else "rad")
            continue
        for j, joint in enumerate(nominal.joint_names):
            length = nominal.sliding[j]
            if group == "origin":
                for part in range(3):
                    add(group, j, part, f"{joint}.origin_{'xyz'[part]}", "m")
            elif group == "tilt":
                for part in range(2):
                    add(group, j, part, f"{joint}.tilt_{labels[j][part]}", "rad")
            elif group == "compliance":
                add(group, j, 0, f"{joint}.compliance", "m/N" if length else "rad/Nm")
            elif nominal.driven[j]:
                add(group, j, 0, f"{joint}.offset", "m" if length else "rad")
    return Errors(nominal, tuple(kinds), tuple(names), tuple(units), tangents)


def _tangents(axis: Array) -> tuple[Array, list[tuple[str, str]]]:
    """Return two directions (j, 2, 3) normal to every axis, and their names (x, y, z if parallel to one)."""
    out = np.empty((len(axis), 2, 3))
    labels = []
    for j, a in enumerate(axis):
        main = int(np.argmax(np.abs(a)))
        first, second = (k for k in range(3) if k != main)
        u = np.eye(3)[first] - a[first] * a
        u /= np.linalg.norm(u)
        v = np.cross(a, u)
        v *= np.sign(v[second])
        out[j] = u, v
        exact = abs(a[main]) > 1.0 - 1e-12
        labels.append(("xyz"[first], "xyz"[second]) if exact else ("1", "2"))
    return out, labels


def _turn(vector: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of rotation vectors (..., 3), Rodrigues' formula."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    k = cross_matrix(vector)
    # np.sinc(x) is sin(pi x) / (pi x): smooth at zero.
    a = np.sinc(angle / np.pi)
    b = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + a * k + b * (k @ k), dtype=np.float64)


def left_jacobian(vector: Array) -> Array:
    """Return J (..., 3, 3) with ``exp(v + dv) = exp(J dv) exp(v)`` for rotation vectors v (..., 3)."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    k = cross_matrix(vector)
    b = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    c = np.where(small, 1.0 / 6.0, (1.0 - np.sinc(safe / np.pi)) / safe**2)
    return np.asarray(np.eye(3) + b * k + c * (k @ k), dtype=np.float64)


def cross_matrix(vector: Array) -> Array:
    """Return the matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    out = np.zeros((*vector.shape, 3))
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


def _rows(field: str, value: ArrayLike, columns: int) -> Array:
    array = real(field, value)
    if array.ndim != 2 or array.shape[1] != columns or not len(array):
        raise InputError(f"{field}: expected shape (n, {columns}), got {array.shape}")
    return array


def real(field: str, value: ArrayLike) -> Array:
    """Return finite real numbers as float64."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{field}: expected real numbers, got {array.dtype}")
    if not np.isfinite(array).all():
        raise InputError(f"{field}: expected finite values, got NaN or infinity")
    return array.astype(np.float64)


def _vector(field: str, value: ArrayLike) -> Array:
    array = real(field, value)
    if array.shape != (3,):
        raise InputError(f"{field}: expected shape (3,), got {array.shape}")
    return array


def _rotation(field: str, value: ArrayLike | None) -> Array:
    if value is None:
        return np.eye(3)
    array = real(field, value)
    if array.shape != (3, 3):
        raise InputError(f"{field}: expected shape (3, 3), got {array.shape}")
    refuse_no_rotation(field, array[None])
    return array


def refuse_no_rotation(field: str, matrices: Array) -> None:
    """Raise InputError for matrices (n, 3, 3) that are not rotations."""
    off = np.abs(np.swapaxes(matrices, 1, 2) @ matrices - np.eye(3)).max()
    if off > 1e-6 or np.any(np.linalg.det(matrices) < 0):
        raise InputError(
            f"{field}: expected rotation matrices (orthonormal, determinant 1), got some that are "
            f"off by {off:.2g} or mirrored"
        )
