"""Checks of the inputs of a simulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError
from axisight.robot import Robot

Array = NDArray[np.float64]


def one_input(
    robot: Robot, velocity_ref: ArrayLike | None, torque: ArrayLike | None, *, dims: int
) -> tuple[Array, bool]:
    """Return the only given input, of ``dims`` dimensions, and whether it is a reference."""
    if velocity_ref is not None and torque is None:
        return _array(robot, "velocity_ref_rad_s", velocity_ref, dims), True
    if torque is not None and velocity_ref is None:
        return _array(robot, "torque_nm", torque, dims), False
    raise InputError("velocity_ref_rad_s, torque_nm: expected exactly one of them")


def _array(robot: Robot, field: str, value: ArrayLike, dims: int) -> Array:
    """Return a checked real array of ``dims`` dimensions, none empty, the last one over axes."""
    runs = "" if dims == 2 else "n_runs, "
    expected = f"{field}: expected real numbers of shape ({runs}n, {robot.n_axes})"
    try:
        data = np.asarray(value)
    except ValueError:
        raise InputError(f"{expected}, got rows of different lengths") from None
    if data.dtype.kind not in "biuf":
        raise InputError(f"{expected}, got {data.dtype}")
    data = np.ascontiguousarray(data, dtype=np.float64)
    if data.ndim == dims - 1 and robot.n_axes == 1:
        data = data[..., None]
    if data.ndim != dims or data.shape[-1] != robot.n_axes:
        raise InputError(f"{expected}, got {data.shape}")
    if data.size == 0:
        raise InputError(f"{expected}, at least one sample of one run, got {data.shape}")
    return data


def given_noise(
    robot: Robot,
    noise: ArrayLike | None,
    shape: tuple[int, ...],
    seed: int | None,
    cutoff_hz: float | None,
) -> Array | None:
    """Return the given noise in the shape of the input, None without."""
    if cutoff_hz is not None and seed is None:
        raise InputError(f"noise_cutoff_hz: expected a noise_seed with it, got {cutoff_hz} alone")
    if noise is None:
        return None
    if seed is not None:
        raise InputError("noise, noise_seed: expected at most one of them")
    data = _array(robot, "noise", noise, len(shape))
    if data.shape != shape:
        raise InputError(f"noise: expected the shape of the input, {shape}, got {data.shape}")
    return data


def start_angles(
    robot: Robot, start_rad: ArrayLike | None, n_runs: int
) -> list[list[float]] | None:
    """Return the driven joint angles at rest, common or per run; None for the operating point."""
    if start_rad is None:
        return None
    start = np.asarray(start_rad)
    numbers = start.dtype.kind in "biuf" and np.isfinite(start).all()
    if start.shape not in ((robot.n_axes,), (n_runs, robot.n_axes)) or not numbers:
        each = f", or those of each of {n_runs} runs" if n_runs > 1 else ""
        raise InputError(f"start_rad: expected {robot.n_axes} finite angles{each}, got {start_rad}")
    return [[float(a) for a in row] for row in np.atleast_2d(start)]
