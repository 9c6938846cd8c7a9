"""Closed-loop and torque-driven simulation of many runs; a single run is a batch of one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from importlib.metadata import version
from typing import Any, Literal, cast, get_args

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import one_of
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.remainder import RunningRemainder
from axisight.robot import Robot
from axisight.robot.accelerometer import DIRECTIONS, by_direction
from axisight.simulation.beside import Beside, acting_remainder, beside
from axisight.simulation.inputs import given_noise, one_input, start_angles
from axisight.simulation.integrator import Integrator, Method
from axisight.simulation.noise import sensor_noise

Array = NDArray[np.float64]
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
    start_rad: ArrayLike | None = None,
    model: Model = "nonlinear",
    method: Method = "dopri5",
    tolerance: float = 1e-7,
    substeps: int = 1,
    remainder: RunningRemainder | None = None,
) -> xr.Dataset:
    """Return a simulation from rest at an operating point, at the controller's sample time.

    Parameters
    ----------
    robot : the robot, with the effects of its file.
    velocity_ref_rad_s : (n, n_axes), motor-side references [rad/s] for the controller.
    torque_nm : (n, n_axes), commanded motor torques [Nm] without controller. Give exactly one of
        references and torques.
    effects : further effects. An effect replaces one of the robot with the same name and axis.
    noise_seed, run : seed and run of the position noise of the robot's sensor, a function of
        (seed, run); no noise without a seed.
    noise : (n, n_axes) position noise [rad] instead of seeded noise.
    noise_cutoff_hz : corner of a first-order spectrum of the seeded noise [Hz]; None for white noise.
    position_resolution_rad : step of the position sensor [rad], motor side; zero for none.
    start_rad : (n_axes,) driven joint angles at rest [rad]; default the operating point.
    model : ``"nonlinear"``, or ``"linear"``: linearized at the start and exactly sampled, but with
        nonlinear ripple and torque path (thesis section 8.1).
    method, tolerance, substeps : integrator of the nonlinear model, e.g. ``"dopri5"`` with a
        tolerance or ``"rk4"`` with sub-steps; see :class:`axisight.simulation.Integrator`.
    remainder : a modelled remainder with its start, in place of that of the robot's file. By default each
        axis moved last in the direction in which its reference moves first.

    Returns
    -------
    Dataset with dims (time, axis) and (time, joint): ``torque_cmd_nm``,
    ``position_rad`` (measured), ``motor_position_rad`` and
    ``joint_position_rad`` (true), ``torque_disturbance_nm``,
    ``position_disturbance_rad``. A robot with accelerometers also has their readings
    ``acceleration_m_s2`` (time, accelerometer, direction), without noise: acceleration minus gravity,
    before the command of the sample acts. ``attrs["status"]`` is ``completed``,
    ``diverged`` or ``step_size_collapsed`` (an unstable loop ends as either of these two, and the
    arrays then end at the failed sample). Further attributes count steps and evaluations.

    Raises InputError for wrong shapes, non-finite input, unknown effects or a missing controller.

    """
    out = _simulated(
        robot,
        one_input(robot, velocity_ref_rad_s, torque_nm, dims=2),
        [run],
        effects=effects,
        noise=noise,
        noise_seed=noise_seed,
        noise_cutoff_hz=noise_cutoff_hz,
        resolution_rad=position_resolution_rad,
        start_rad=start_rad,
        model=model,
        integrator=Integrator(method, tolerance, substeps),
        threads=1,
        remainder=remainder,
    )
    at = out["stopped_at"][0]
    attrs = {
        "status": out["status"][0],
        "stopped_at": -1 if at is None else at,
        **{name: out[counter][0] for name, counter in _COUNTERS.items()},
        "noise_seed": -1 if noise_seed is None else noise_seed,
        "run": run,
        "model": model,
        "method": method,
    }
    seen = slice(None if at is None else at + 1)
    return _dataset(robot, out, ("time",), (0, seen), attrs)


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
    start_rad: ArrayLike | None = None,
    model: Model = "nonlinear",
    method: Method = "dopri5",
    tolerance: float = 1e-7,
    substeps: int = 1,
    threads: int = 0,
    remainder: RunningRemainder | None = None,
) -> xr.Dataset:
    """Return the simulations of many runs of one robot, computed eight in lock-step per thread.

    With fixed steps and with the linear model, a run has the same bits as alone. With an
    error-controlled method, the eight runs take the shortest step that any of them needs, so a run
    differs from the same run alone within the tolerance. Implicit methods run one by one.

    Parameters
    ----------
    robot : the robot, with the effects of its file.
    velocity_ref_rad_s : (n_runs, n, n_axes), motor-side references [rad/s].
    torque_nm : (n_runs, n, n_axes), commanded motor torques [Nm]. Give exactly one of references and
        torques.
    noise_seed, first_run : the noise of run ``i`` is that of ``run=first_run + i``.
    noise : (n_runs, n, n_axes) position noise [rad] instead of seeded noise.
    threads : number of threads, 0 for all cores. The result does not depend on it.
    start_rad : (n_axes,) driven joint angles at rest [rad], or (n_runs, n_axes) for a start per run;
        the linear model allows one start. Default the operating point.
    effects, noise_cutoff_hz, position_resolution_rad, model, method, tolerance, substeps, remainder : as in
    :func:`simulate`, the same for all runs. Runs with a remainder are computed one after another.

    Returns
    -------
    Dataset with the variables of :func:`simulate` and a first dimension ``run``, and
    ``status`` and ``stopped_at`` (run). A failed run is NaN after its failed sample and does not
    affect the others. Raises InputError as :func:`simulate` does.

    """
    drive = one_input(robot, velocity_ref_rad_s, torque_nm, dims=3)
    runs = range(first_run, first_run + len(drive[0]))
    out = _simulated(
        robot,
        drive,
        runs,
        effects=effects,
        noise=noise,
        noise_seed=noise_seed,
        noise_cutoff_hz=noise_cutoff_hz,
        resolution_rad=position_resolution_rad,
        start_rad=start_rad,
        model=model,
        integrator=Integrator(method, tolerance, substeps),
        threads=threads,
        remainder=remainder,
    )
    attrs = {
        "noise_seed": -1 if noise_seed is None else noise_seed,
        "model": model,
        "method": method,
    }
    result = _dataset(robot, out, ("run", "time"), (), attrs)
    stopped = [-1 if at is None else at for at in out["stopped_at"]]
    return result.assign_coords(run=np.array(runs)).assign(
        status=("run", np.array(out["status"])),
        stopped_at=("run", np.array(stopped)),
        right_hand_sides=("run", np.array(out["evaluations"])),
    )


def _simulated(
    robot: Robot,
    drive: tuple[Array, bool],
    runs: Sequence[int],
    *,
    effects: Iterable[Effect],
    noise: ArrayLike | None,
    noise_seed: int | None,
    noise_cutoff_hz: float | None,
    resolution_rad: float,
    start_rad: ArrayLike | None,
    model: Model,
    integrator: Integrator,
    threads: int,
    remainder: RunningRemainder | None,
) -> _core.BatchOutput:
    """Return the simulation of ``runs``, whose numbers determine the noise.

    ``drive`` is the result of `one_input`. The input of a single run, and given noise, may lack the
    dimension of runs.
    """
    one_of("model", model, get_args(Model))
    data, reference = drive
    error = given_noise(robot, noise, data.shape, noise_seed, noise_cutoff_hz)
    shape = (len(runs), *data.shape[-2:])
    if noise_seed is not None:
        error = np.empty(shape)
        for row, run in zip(error, runs, strict=True):
            row[:] = sensor_noise(robot, noise_seed, run, shape[1], noise_cutoff_hz)
    if threads < 0:
        raise InputError(f"threads: expected 0 (all cores) or more, got {threads}")
    running = acting_remainder(robot, remainder, model)
    starts = start_angles(robot, start_rad, len(runs))
    placed = core_effects(robot.placed(effects))
    inputs = data.reshape(shape)
    disturbed = None if error is None else error.reshape(shape)

    def simulated(of: slice, acting: Beside | None) -> _core.BatchOutput:
        return _core.simulate_batch(
            robot.core,
            placed,
            inputs[of],
            reference=reference,
            integrator=integrator,
            noise=None if disturbed is None else disturbed[of],
            start=starts[of] if starts and len(starts) > 1 else starts,
            model=model,
            resolution=resolution_rad,
            threads=threads,
            beside=acting,
        )

    if running is None:
        return simulated(slice(None), None)
    each = (
        simulated(slice(i, i + 1), beside(running, inputs[i] if reference else None))
        for i in range(len(runs))
    )
    return _joined(list(each))


def _joined(each: Sequence[_core.BatchOutput]) -> _core.BatchOutput:
    """Return the outputs of single runs as that of a batch."""
    out: dict[str, Any] = {}
    for name, first in each[0].items():
        parts = [cast("dict[str, Any]", one)[name] for one in each]
        is_signal = isinstance(first, np.ndarray)
        out[name] = np.concatenate(parts) if is_signal else [x for part in parts for x in part]
    return cast("_core.BatchOutput", out)


_Counter = Literal[
    "evaluations", "steps", "rejections", "jacobians", "factorizations", "implicit_samples"
]
# Counters of effort: names of attributes, and names in the compiled core.
_COUNTERS: dict[str, _Counter] = {
    "right_hand_sides": "evaluations",
    "steps": "steps",
    "rejected_steps": "rejections",
    "jacobians": "jacobians",
    "factorizations": "factorizations",
    "implicit_samples": "implicit_samples",
}
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


@cache
def _version() -> str:
    """Return the version, cached because the look-up takes as long as a short run."""
    return version("axisight")


def _dataset(
    robot: Robot,
    out: _core.BatchOutput,
    dims: tuple[str, ...],
    part: tuple[int | slice, ...],
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Return the signals of the runs and samples that ``part`` selects."""
    variables = {
        name: ((*dims, "axis"), out[name][part], {"units": _UNITS[name.rsplit("_", 1)[1]]})
        for name in _PER_AXIS
    }
    joint = (*dims, "joint"), out["joint_position_rad"][part], {"units": "rad"}
    n = joint[1].shape[-2]
    return xr.Dataset(
        {**variables, "joint_position_rad": joint, **_accelerations(robot, out, dims, part)},
        coords={
            "time": ("time", np.arange(n) * robot.sample_time_s, {"units": "s"}),
            "axis": robot.axis_numbers(),
            "joint": robot.joint_names,
            **_places(robot),
        },
        attrs={"robot": robot.name, **attrs, "axisight_version": _version()},
    )


def _accelerations(
    robot: Robot, out: _core.BatchOutput, dims: tuple[str, ...], part: tuple[int | slice, ...]
) -> dict[str, tuple[tuple[str, ...], Array, dict[str, str]]]:
    """Return the readings of accelerometers as a variable; none without accelerometers."""
    if "acceleration_m_s2" not in out:
        return {}
    readings = by_direction(out["acceleration_m_s2"][part], robot.accelerometers)
    return {
        "acceleration_m_s2": ((*dims, "accelerometer", "direction"), readings, {"units": "m/s^2"})
    }


def _places(robot: Robot) -> dict[str, list[str]]:
    names = [one.name for one in robot.accelerometers]
    return {"accelerometer": names, "direction": list(DIRECTIONS)} if names else {}
