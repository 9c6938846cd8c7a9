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
Method = Literal["dopri5", "rk4", "rkn4", "radau5", "rodas4", "auto"]
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
    method, tolerance, substeps : integrator of the nonlinear model. ``"rk4"`` and
        ``"rkn4"`` (Nyström's method: the same order, faster) take ``substeps`` fixed
        sub-steps per sample. The others hold the local error of every
        state below ``tolerance`` times its size: ``"dopri5"`` (explicit, order 5),
        ``"radau5"`` and ``"rodas4"`` (L-stable, orders 5 and 4, exact Jacobian), and
        ``"auto"``, which goes from ``dopri5`` to ``radau5`` when the plant proves stiff.
        The linear model uses ``substeps`` with these two only, for its ripple.

    Returns
    -------
    Dataset with dims (time, axis) and (time, joint): ``torque_cmd_nm``,
    ``position_rad`` (measured), ``motor_position_rad`` and
    ``joint_position_rad`` (true), ``torque_disturbance_nm``,
    ``position_disturbance_rad``. ``attrs["status"]`` is ``completed``,
    ``diverged`` or ``step_size_collapsed`` (an unstable loop ends as either); the arrays
    then end at the sample that failed. The attributes also count the effort. Raises InputError
    for wrong shapes, non-finite input, unknown effects or a missing controller.

    """
    data, reference = _input(robot, velocity_ref_rad_s, torque_nm, dims=2)
    if substeps < 1:
        raise InputError(f"substeps: expected at least 1, got {substeps}")
    error = _noise(robot, noise, data.shape, noise_seed, noise_cutoff_hz)
    if noise_seed is not None:
        error = sensor_noise(robot, noise_seed, run, len(data), noise_cutoff_hz)
    out = _core.simulate(
        robot.core,
        core_effects([*robot.effects, *effects]),
        data,
        reference=reference,
        noise=error,
        start=_start(robot, start_rad),
        method=method,
        substeps=substeps,
        tolerance=tolerance,
        model=model,
        resolution=position_resolution_rad,
    )
    attrs = {
        **_ending(out),
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

    With fixed steps and with the linear model a run has the bits it has alone; with
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
    if substeps < 1:
        raise InputError(f"substeps: expected at least 1, got {substeps}")
    error = _noise(robot, noise, data.shape, noise_seed, noise_cutoff_hz)
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
        start=_start(robot, start_rad),
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
    if velocity_ref is not None and torque is None:
        return _array(robot, "velocity_ref_rad_s", velocity_ref, dims), True
    if torque is not None and velocity_ref is None:
        return _array(robot, "torque_nm", torque, dims), False
    raise InputError("velocity_ref_rad_s, torque_nm: expected exactly one of them")


def _array(robot: Robot, field: str, value: ArrayLike, dims: int) -> Array:
    """Return real numbers of ``dims`` dimensions, the last one of axes, none of them empty."""
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


def _noise(
    robot: Robot,
    noise: ArrayLike | None,
    shape: tuple[int, ...],
    seed: int | None,
    cutoff_hz: float | None,
) -> Array | None:
    """Return the noise given, in the shape of the input."""
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


def _start(robot: Robot, start_rad: Sequence[float] | None) -> list[float] | None:
    if start_rad is None:
        return None
    start = np.asarray(start_rad)
    numbers = start.dtype.kind in "biuf" and np.isfinite(start).all()
    if start.shape != (robot.n_axes,) or not numbers:
        raise InputError(f"start_rad: expected {robot.n_axes} finite angles, got {start_rad}")
    return [float(a) for a in start]


# Generator and stream of the core's noise; a stream has 16 bits for the axis.
_SEEDS, _RUNS = 1 << 64, 1 << 48


def _check_stream(seed: int, run: int) -> None:
    """Refuse numbers that the core cannot tell apart."""
    for field, value, count in (("seed", seed, _SEEDS), ("run", run, _RUNS)):
        if not 0 <= value < count:
            bits = count.bit_length() - 1
            raise InputError(f"{field}: expected 0 to 2^{bits} - 1, got {value}")


def _ending(out: _core.SimulationOutput) -> dict[str, Any]:
    """Return how a run ended and what it cost, as attributes."""
    return {
        "status": out["status"],
        "stopped_at": -1 if out["stopped_at"] is None else out["stopped_at"],
        "right_hand_sides": out["evaluations"],
        "steps": out["steps"],
        "rejected_steps": out["rejections"],
        "jacobians": out["jacobians"],
        "factorizations": out["factorizations"],
        "implicit_samples": out["implicit_samples"],
    }


def white_noise(seed: int, run: int, n_samples: int, n_axes: int) -> Array:
    """Return unit white Gaussian noise (n_samples, n_axes) as a function of (seed, run)."""
    _check_stream(seed, run)
    return _core.measurement_noise(seed, run, n_samples, n_axes, 1.0)


def sensor_noise(
    robot: Robot, seed: int, run: int, n_samples: int, cutoff_hz: float | None = None
) -> Array:
    """Return position noise (n_samples, n_axes) [rad] of the robot's sensor.

    A function of (seed, run) with the standard deviation of the sensor; white, or first
    order with corner ``cutoff_hz``. Raises InputError for a cutoff that is not positive.
    """
    std = robot.position_noise_std
    if cutoff_hz is None:
        return white_noise(seed, run, n_samples, robot.n_axes) * std
    _check_stream(seed, run)
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
