"""Motion of a floating base and its joints from a record: motion capture, or an inertial measurement unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.rigid_body.motion import MotionEstimate, estimate_motion
from axisight.rigid_body.regressor import rows
from axisight.robot import BaseMotion

Array = NDArray[np.float64]

# Quaternions with four digits.
_UNIT = 1e-3


@summarized
@dataclass(frozen=True, eq=False)
class FloatingRecord:
    """A motion of joints and base without its noise, for `identify_floating` and `contact_check`.

    q, v, a
        (n, n_joints) joint angles, velocities and accelerations [rad, rad/s, rad/s^2].
    base
        Motion of the base, n rows.
    torque_nm
        (n, n_torques) torques through the same filter [Nm]; None without torques.
    filtered
        Times, sample time, band and dropped samples of the filter.
    """

    q: Array
    v: Array
    a: Array
    base: BaseMotion
    torque_nm: Array | None
    filtered: MotionEstimate


def record_of_pose(
    q: ArrayLike,
    position_m: ArrayLike,
    quaternion_xyzw: ArrayLike,
    torque_nm: ArrayLike | None = None,
    *,
    gravity_m_s2: ArrayLike = (0.0, 0.0, -9.81),
    **options: Any,
) -> FloatingRecord:
    """Return the motion from joint angles and poses of the base, such as those of motion capture.

    ``q`` (n, n_joints) [rad], ``position_m`` (n, 3) of the base frame's origin in world axes, and
    ``quaternion_xyzw`` (n, 4), which turns vectors in base axes into world axes, are sampled together.
    ``torque_nm`` (n, n_torques) passes the same filter. ``gravity_m_s2`` (3,) is in world axes. ``options`` are those
    of :func:`estimate_motion`: ``sample_time_s`` and ``cutoff_hz`` must be given.

    Two derivatives of a pose amplify noise by the square of the frequency: choose the cutoff from the motion. The
    angular velocity is the vector part of ``2 conj(p) p'`` with the quaternion p, and its derivative that of
    ``2 conj(p) p''``, both for unit length. Raises InputError for other shapes and for quaternions that are not of
    unit length.
    """
    joints = _joints(q)
    places = rows("position_m", position_m, 3)
    turns = rows("quaternion_xyzw", quaternion_xyzw, 4)
    if np.abs(np.linalg.norm(turns, axis=1) - 1.0).max() > _UNIT:
        raise InputError("quaternion_xyzw: expected quaternions of unit length, got others")
    # p and -p are the same rotation; the filter needs a continuous one.
    same = np.cumprod(np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    turns = turns * np.concatenate([[1.0], same])[:, None]
    found, (q0, _, r0), (q1, _, r1), (q2, p2, r2), torque = _filtered(
        torque_nm, options, q=joints, position_m=places, quaternion_xyzw=turns
    )
    length = np.linalg.norm(r0, axis=1, keepdims=True)
    growing = (r0 * r1).sum(axis=1, keepdims=True) / length**2
    velocity = 2.0 * _relative(r0, r1) / length**2
    growth = 2.0 * _relative(r0, r2) / length**2 - 2.0 * growing * velocity
    rotation = scipy.spatial.transform.Rotation.from_quat(r0)
    proper = rotation.inv().apply(p2 - np.asarray(gravity_m_s2, dtype=np.float64))
    return FloatingRecord(q0, q1, q2, BaseMotion(velocity, growth, proper), torque, found)


def record_of_imu(
    q: ArrayLike,
    angular_velocity_rad_s: ArrayLike,
    specific_force_m_s2: ArrayLike,
    torque_nm: ArrayLike | None = None,
    *,
    position_m: ArrayLike = (0.0, 0.0, 0.0),
    rotation: ArrayLike | None = None,
    **options: Any,
) -> FloatingRecord:
    """Return the motion from joint angles and an inertial measurement unit on the base.

    ``q`` (n, n_joints) [rad], the gyroscope ``angular_velocity_rad_s`` (n, 3) and the accelerometer
    ``specific_force_m_s2`` (n, 3) are sampled together, both in the axes of the unit, without offsets.
    ``position_m`` and ``rotation`` are as in `BaseMotion.from_imu`, ``torque_nm`` and ``options`` as in
    :func:`record_of_pose`. No orientation is needed.
    """
    joints = _joints(q)
    gyroscope = rows("angular_velocity_rad_s", angular_velocity_rad_s, 3)
    force = rows("specific_force_m_s2", specific_force_m_s2, 3)
    found, (q0, w0, f0), (q1, w1, _), (q2, _, _), torque = _filtered(
        torque_nm, options, q=joints, angular_velocity_rad_s=gyroscope, specific_force_m_s2=force
    )
    base = BaseMotion.from_imu(w0, w1, f0, position_m=position_m, rotation=rotation)
    return FloatingRecord(q0, q1, q2, base, torque, found)


def _joints(q: ArrayLike) -> Array:
    shape = np.shape(q)
    return rows("q", q, shape[1] if len(shape) == 2 else 1)


def _filtered(
    torque_nm: ArrayLike | None, options: dict[str, Any], **signals: Array
) -> tuple[MotionEstimate, list[Array], list[Array], list[Array], Array | None]:
    """Return the filter, each signal with its first and second derivative, and the torque."""
    n = len(signals["q"])
    for name, signal in signals.items():
        if len(signal) != n:
            raise InputError(f"{name}: expected {n} rows as q, got {len(signal)}")
    parts = list(signals.values())
    if torque_nm is not None:
        shape = np.shape(torque_nm)
        torque = rows("torque_nm", torque_nm, shape[1] if len(shape) == 2 else 1)
        if len(torque) != n:
            raise InputError(f"torque_nm: expected {n} rows as q, got {len(torque)}")
        parts.append(torque)
    # The torque is one more signal of which only the value counts, so that all pass one filter.
    found = estimate_motion(np.hstack(parts), None, **options)
    ends = np.cumsum([part.shape[1] for part in parts])[:-1]
    value, slope, bend = (
        np.split(x, ends, axis=1)
        for x in (found.position_rad, found.velocity_rad_s, found.acceleration_rad_s2)
    )
    if torque_nm is None:
        return found, value, slope, bend, None
    return found, value[:-1], slope[:-1], bend[:-1], value[-1]


def _relative(a: Array, b: Array) -> Array:
    """Return the vector part (n, 3) of conj(a) b, for quaternions (n, 4) with the real part last."""
    turned = a[:, 3:] * b[:, :3] - b[:, 3:] * a[:, :3]
    return np.asarray(turned - np.cross(a[:, :3], b[:, :3]))
