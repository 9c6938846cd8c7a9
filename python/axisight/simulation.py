"""Closed-loop and torque-driven simulation: one run, or many at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.metadata import version
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.robot import Robot

Array = NDArray[np.float64]
Method = Literal["dopri5", "rk4", "radau5", "rodas4", "auto"]
Model = Literal["nonlinear", "linear"]


def simulate(
    robot: Robot,
    velocity_ref_rad_s: ArrayLike | None = None,
    *,
    torque_nm: ArrayLike | None = None,
    effects: Iterable[Effect] = (),
    noise_seed: int | None = None,
    run: int = 0,
    noise: ArrayLike | None = None,
    noise_cutoff_hz: float | None = None,
    position_resolution_rad: float = 0.0,
    start_rad: Sequence[float] | None = None,
    model: Model = "nonlinear",
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
    noise_cutoff_hz : corner of a first-order spectrum of the seeded noise; white without.
    position_resolution_rad : step of the position sensor, motor side; zero for none.
    start_rad : (n_axes,) driven joint angles at rest; default the operating point.
    model : ``"nonlinear"``, or ``"linear"``: linearized at the start, exactly sampled, with
        ripple and the torque path as they are (thesis section 8.1).
    method, tolerance, substeps : integrator of the nonlinear model. ``"rk4"`` takes
        ``substeps`` fixed sub-steps per sample. The others hold the local error of every
        state below ``tolerance`` times its size: ``"dopri5"`` (explicit, order 5),
        ``"radau5"`` and ``"rodas4"`` (L-stable, orders 5 and 4, exact Jacobian), and
        ``"auto"``, which goes from ``dopri5`` to ``radau5`` when the plant proves stiff.
        The linear model uses ``substeps`` with ``"rk4"`` only, for its ripple.

    Returns
    -------
    Dataset with dims (time, axis) and (time, joint): ``torque_cmd_nm``,
    ``position_rad`` (measured), ``motor_position_rad`` and
    ``joint_position_rad`` (true), ``torque_disturbance_nm``,
    ``position_disturbance_rad``. ``attrs["status"]`` is ``completed``,
    ``diverged`` (unstable loop) or ``step_size_collapsed``; the arrays then
    end at the sample that failed. The attributes also count the effort. Raises InputError
    for wrong shapes, non-finite input, unknown effects or a missing controller.

    """
    data, reference = _input(robot, velocity_ref_rad_s, torque_nm, dims=2)
    error = None if noise is None else np.ascontiguousarray(np.asarray(noise, dtype=np.float64))
    if noise_seed is not None:
        error = sensor_noise(robot, noise_seed, run, len(data), noise_cutoff_hz)
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
        model=model,
        resolution=position_resolution_rad,
    )
    attrs = {
        "status": out["status"],
        "stopped_at": -1 if out["stopped_at"] is None else out["stopped_at"],
        "right_hand_sides": out["evaluations"],
        "steps": out["steps"],
        "rejected_steps": out["rejections"],
        "jacobians": out["jacobians"],
        "factorizations": out["factorizations"],
        "implicit_samples": out["implicit_samples"],
        "noise_seed": -1 if noise_seed is None else noise_seed,
        "run": run,
        "model": model,
        "method": method,
    }
    return _dataset(robot, out, ("time",), attrs)


def simulate_batch(
    robot: Robot,
    velocity_ref_rad_s: ArrayLike | None = None,
    *,
    torque_nm: ArrayLike | None = None,
    effects: Iterable[Effect] = (),
    noise_seed: int | None = None,
    first_run: int = 0,
    noise: ArrayLike | None = None,
    noise_cutoff_hz: float | None = None,
    position_resolution_rad: float = 0.0,
    start_rad: Sequence[float] | None = None,
    model: Model = "nonlinear",
    method: Method = "dopri5",
    tolerance: float = 1e-7,
    substeps: int = 1,
    threads: int = 0,
) -> xr.Dataset:
    """Simulate many runs of one robot: eight in lock-step per thread.

    With ``method="rk4"`` and with the linear model a run has the bits it has alone; with
    an error-controlled method the eight take the shortest step any of them needs, so a run
    differs from itself alone by what the tolerance allows. Implicit methods run one by one.

    Parameters
    ----------
    robot : the robot; effects its preset models take part.
    velocity_ref_rad_s : (n_runs, n, n_axes), motor-side references; or
    torque_nm : (n_runs, n, n_axes), commanded motor torques. Give exactly one.
    noise_seed, first_run : the noise of run ``i`` is that of ``run=first_run + i``.
    noise : (n_runs, n, n_axes) position noise [rad] instead of a seeded one.
    threads : 0 takes every core. The result does not depend on it.
    effects, noise_cutoff_hz, position_resolution_rad, start_rad, model, method, tolerance,
    substeps : as in :func:`simulate`, the same for all runs.

    Returns
    -------
    Dataset with the variables of :func:`simulate` and a first dimension ``run``, and
    ``status`` and ``stopped_at`` (run). Runs that failed are NaN from the sample after the
    one that failed, and spoil no other. Raises InputError as :func:`simulate`.

    """
    data, reference = _input(robot, velocity_ref_rad_s, torque_nm, dims=3)
    error = None if noise is None else np.ascontiguousarray(np.asarray(noise, dtype=np.float64))
    runs = np.arange(first_run, first_run + len(data))
    if noise_seed is not None:
        n = data.shape[1]
        error = np.stack(
            [sensor_noise(robot, noise_seed, int(r), n, noise_cutoff_hz) for r in runs]
        )
    if threads < 0:
        raise InputError(f"threads: expected 0 (all cores) or more, got {threads}")
    out = _core.simulate_batch(
        robot.core,
        core_effects([*robot.effects, *effects]),
        data,
        reference=reference,
        noise=error,
        start=None if start_rad is None else [float(a) for a in start_rad],
        method=method,
        substeps=substeps,
        tolerance=tolerance,
        model=model,
        resolution=position_resolution_rad,
        threads=threads,
    )
    attrs = {
        "noise_seed": -1 if noise_seed is None else noise_seed,
        "model": model,
        "method": method,
    }
    result = _dataset(robot, out, ("run", "time"), attrs)
    stopped = [-1 if at is None else at for at in out["stopped_at"]]
    return result.assign_coords(run=runs).assign(
        status=("run", np.array(out["status"])),
        stopped_at=("run", np.array(stopped)),
        right_hand_sides=("run", np.array(out["evaluations"])),
    )


def _input(
    robot: Robot, velocity_ref: ArrayLike | None, torque: ArrayLike | None, *, dims: int
) -> tuple[Array, bool]:
    """Return the one input given, and whether it is a reference."""
    if (velocity_ref is None) == (torque is None):
        raise InputError("velocity_ref_rad_s, torque_nm: expected exactly one of them")
    reference = velocity_ref is not None
    source = velocity_ref if reference else torque
    data = np.ascontiguousarray(np.asarray(source, dtype=np.float64))
    if data.ndim == dims - 1 and robot.n_axes == 1:
        data = data[..., None]
    if data.ndim != dims or data.shape[-1] != robot.n_axes or data.size == 0:
        field = "velocity_ref_rad_s" if reference else "torque_nm"
        shape = f"(n, {robot.n_axes})" if dims == 2 else f"(n_runs, n, {robot.n_axes})"
        raise InputError(f"{field}: expected shape {shape}, got {data.shape}")
    return data, reference


def white_noise(seed: int, run: int, n_samples: int, n_axes: int) -> Array:
    """Return unit white Gaussian noise (n_samples, n_axes) as a function of (seed, run)."""
    return _core.measurement_noise(seed, run, n_samples, n_axes, 1.0)


def sensor_noise(
    robot: Robot, seed: int, run: int, n_samples: int, cutoff_hz: float | None = None
) -> Array:
    """Return position noise (n_samples, n_axes) [rad] of the robot's sensor.

    A function of (seed, run) with the standard deviation of the sensor; white, or first
    order with corner ``cutoff_hz``. Raises InputError for a cutoff that is not positive.
    """
    std = robot.core.position_noise_std
    if cutoff_hz is None:
        return white_noise(seed, run, n_samples, robot.n_axes) * std
    step = robot.sample_time_s
    return _core.measurement_noise(
        seed, run, n_samples, robot.n_axes, std, cutoff_hz=cutoff_hz, sample_time=step
    )


_UNITS = {"nm": "Nm", "rad": "rad"}
_PER_AXIS: tuple[
    Literal[
        "torque_cmd_nm",
        "position_rad",
        "motor_position_rad",
        "torque_disturbance_nm",
        "position_disturbance_rad",
    ],
    ...,
] = (
    "torque_cmd_nm",
    "position_rad",
    "motor_position_rad",
    "torque_disturbance_nm",
    "position_disturbance_rad",
)


def _dataset(
    robot: Robot,
    out: _core.SimulationOutput | _core.BatchOutput,
    dims: tuple[str, ...],
    attrs: dict[str, Any],
) -> xr.Dataset:
    variables = {
        name: ((*dims, "axis"), out[name], {"units": _UNITS[name.rsplit("_", 1)[1]]})
        for name in _PER_AXIS
    }
    joint = (*dims, "joint"), out["joint_position_rad"], {"units": "rad"}
    n = out["position_rad"].shape[-2]
    return xr.Dataset(
        {**variables, "joint_position_rad": joint},
        coords={
            "time": ("time", np.arange(n) * robot.sample_time_s, {"units": "s"}),
            "axis": robot.axis_numbers(),
            "joint": robot.joint_names,
        },
        attrs={"robot": robot.name, **attrs, "axisight_version": version("axisight")},
    )
