"""Closed-loop and torque-driven simulation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.metadata import version
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.robot import Robot

Method = Literal["dopri5", "rk4"]


def simulate(
    robot: Robot,
    velocity_ref_rad_s: ArrayLike | None = None,
    *,
    torque_nm: ArrayLike | None = None,
    effects: Iterable[Effect] = (),
    noise_seed: int | None = None,
    run: int = 0,
    noise: ArrayLike | None = None,
    start_rad: Sequence[float] | None = None,
    method: Method = "dopri5",
    tolerance: float = 1e-7,
    substeps: int = 1,
) -> xr.Dataset:
    """Simulate from rest at an operating point, sampled as the controller samples.

    Parameters
    ----------
    robot : the robot; effects its preset models take part.
    velocity_ref_rad_s : (n, n_axes), motor-side references through the controller; or
    torque_nm : (n, n_axes), commanded motor torques without controller. Give exactly one.
    effects : further effects.
    noise_seed, run : position noise of the robot's sensor as a function of
        (seed, run); no noise without a seed.
    noise : (n, n_axes) position noise [rad] instead of a seeded one.
    start_rad : (n_axes,) driven joint angles at rest; default the operating point.
    method, tolerance, substeps : ``"dopri5"`` halves its sub-step until the local
        error of every state is below ``tolerance`` times its size; ``"rk4"``
        takes ``substeps`` fixed sub-steps per sample.

    Returns
    -------
    Dataset with dims (time, axis) and (time, joint): ``torque_cmd_nm``,
    ``position_rad`` (measured), ``motor_position_rad`` and
    ``joint_position_rad`` (true), ``torque_disturbance_nm``,
    ``position_disturbance_rad``. ``attrs["status"]`` is ``completed``,
    ``diverged`` (unstable loop) or ``step_size_collapsed``; the arrays then
    end at the sample that failed. Raises InputError for wrong shapes,
    non-finite input, unknown effects or a missing controller.

    """
    if (velocity_ref_rad_s is None) == (torque_nm is None):
        raise InputError("velocity_ref_rad_s, torque_nm: expected exactly one of them")
    reference = velocity_ref_rad_s is not None
    source = velocity_ref_rad_s if reference else torque_nm
    data = np.ascontiguousarray(np.asarray(source, dtype=np.float64))
    if data.ndim == 1 and robot.n_axes == 1:
        data = data[:, None]
    if data.ndim != 2 or data.shape[1] != robot.n_axes or len(data) == 0:
        field = "velocity_ref_rad_s" if reference else "torque_nm"
        raise InputError(f"{field}: expected shape (n, {robot.n_axes}), got {data.shape}")
    error = None if noise is None else np.ascontiguousarray(np.asarray(noise, dtype=np.float64))
    if noise_seed is not None:
        std = robot.core.position_noise_std
        error = white_noise(noise_seed, run, len(data), robot.n_axes) * std
    out = _core.simulate(
        robot.core,
        core_effects([*robot.effects, *effects]),
        data,
        reference=reference,
        noise=error,
        start=None if start_rad is None else [float(a) for a in start_rad],
        method=method,
        substeps=substeps,
        tolerance=tolerance,
    )
    return _dataset(robot, out, noise_seed, run)


def white_noise(seed: int, run: int, n_samples: int, n_axes: int) -> NDArray[np.float64]:
    """Return unit white Gaussian noise (n_samples, n_axes) as a function of (seed, run)."""
    return _core.measurement_noise(seed, run, n_samples, n_axes, 1.0)


_UNITS = {"nm": "Nm", "rad": "rad"}


def _dataset(robot: Robot, out: _core.SimulationOutput, seed: int | None, run: int) -> xr.Dataset:
    per_axis = (
        ("torque_cmd_nm", out["torque_cmd_nm"]),
        ("position_rad", out["position_rad"]),
        ("motor_position_rad", out["motor_position_rad"]),
        ("torque_disturbance_nm", out["torque_disturbance_nm"]),
        ("position_disturbance_rad", out["position_disturbance_rad"]),
    )
    variables = {
        name: (("time", "axis"), value, {"units": _UNITS[name.rsplit("_", 1)[1]]})
        for name, value in per_axis
    }
    joint = ("time", "joint"), out["joint_position_rad"], {"units": "rad"}
    n = len(out["position_rad"])
    return xr.Dataset(
        {**variables, "joint_position_rad": joint},
        coords={
            "time": ("time", np.arange(n) * robot.sample_time_s, {"units": "s"}),
            "axis": robot.axis_numbers(),
            "joint": robot.joint_names,
        },
        attrs={
            "robot": robot.name,
            "status": out["status"],
            "stopped_at": -1 if out["stopped_at"] is None else out["stopped_at"],
            "right_hand_sides": out["evaluations"],
            "rejected_steps": out["rejections"],
            "noise_seed": -1 if seed is None else seed,
            "run": run,
            "axisight_version": version("axisight"),
        },
    )
