"""Gears and couplings between motors and joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.robot import Robot

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False)
class MotorCoupling:
    """The coupling of the motors of all driven axes to their joints.

    position
        Matrix R, shape (n_axes, n_axes) [rad/rad]: motor angles ``phi = R q``. Without
        couplings its diagonal holds the gear ratios as motor angle per joint angle, that is
        one over the ``gear_ratio`` of the robot file.
    torque
        Matrix R_tau, shape (n_axes, n_axes): joint torques ``tau_q = R_tau tau_phi``. Default
        is the transpose of R, by virtual work. Another matrix describes a gearbox with losses, or
        a data set with another conversion of torques.

    Raises InputError for matrices that are not square, not finite or not invertible.
    """

    position: Array
    torque: Array

    def __init__(self, position: ArrayLike, torque: ArrayLike | None = None) -> None:
        r = _matrix("position", position)
        r_tau = r.T.copy() if torque is None else _matrix("torque", torque)
        if r_tau.shape != r.shape:
            raise InputError(f"torque: expected shape {r.shape} as position, got {r_tau.shape}")
        object.__setattr__(self, "position", r)
        object.__setattr__(self, "torque", r_tau)

    @property
    def n_axes(self) -> int:
        """Number of driven axes."""
        return len(self.position)

    def joint_motion(self, motor: ArrayLike) -> Array:
        """Return joint angles [rad] (or rates) of motor angles, shape (n, n_axes) or (n_axes,)."""
        return _solve(self.position, self._rows("motor", motor))

    def motor_motion(self, joint: ArrayLike) -> Array:
        """Return motor angles [rad] (or rates) of joint angles, shape (n, n_axes) or (n_axes,)."""
        return self._rows("joint", joint) @ self.position.T

    def joint_torque(self, motor_nm: ArrayLike) -> Array:
        """Return joint torques [Nm] of motor torques, shape (n, n_axes) or (n_axes,)."""
        return self._rows("motor_nm", motor_nm) @ self.torque.T

    def motor_torque(self, joint_nm: ArrayLike) -> Array:
        """Return motor torques [Nm] of joint torques, shape (n, n_axes) or (n_axes,)."""
        return _solve(self.torque, self._rows("joint_nm", joint_nm))

    def _rows(self, field: str, value: ArrayLike) -> Array:
        x = np.asarray(value, dtype=np.float64)
        if x.ndim not in (1, 2) or x.shape[-1] != self.n_axes:
            raise InputError(
                f"{field}: expected shape ({self.n_axes},) or (n, {self.n_axes}), got {x.shape}"
            )
        return x


def gear_coupling(robot: Robot) -> MotorCoupling:
    """Return the coupling by the gear ratios in the robot file, one motor per joint."""
    return MotorCoupling(np.diag(1.0 / robot.gear_ratio))


def _solve(matrix: Array, rows: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, rows.T).T, dtype=np.float64)


def _matrix(field: str, value: ArrayLike) -> Array:
    try:
        x = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field}: expected a square matrix of numbers, got {error}") from error
    if x.ndim != 2 or x.shape[0] != x.shape[1] or x.size == 0:
        raise InputError(f"{field}: expected a square matrix, got shape {x.shape}")
    if not np.isfinite(x).all():
        raise InputError(f"{field}: expected finite numbers, got NaN or infinity")
    if np.linalg.cond(x) > 1e12:
        raise InputError(f"{field}: expected an invertible matrix, got a singular one")
    return x
