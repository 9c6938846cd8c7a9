"""The command ``axisight simulate``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, cast, get_args

import numpy as np
import pandas as pd
import typer
import xarray as xr
from numpy.typing import NDArray

from axisight.cli.common import Columns, Force, From, Moving, To, errors, numbers, say
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.panels import INTEGRATION, SENSOR
from axisight.cli.robot import GivenEffects, load_simulator, parse_effects
from axisight.errors import InputError
from axisight.excitation import References
from axisight.excitation.files import holds_references, read_references
from axisight.gap.intake.inputs import read_beside
from axisight.gap.prepare.used_part import Used
from axisight.logs import Log
from axisight.logs.sources import files_of
from axisight.robot import Robot
from axisight.robot_import import is_model_file
from axisight.simulation import Method, Model, simulate
from axisight.storage import check_targets, write_bytes

# Largest relative difference between the sample times of log and robot.
_SAME_RATE = 1e-4


def simulate_command(
    robot: Annotated[str, typer.Argument(help="robot.toml, URDF, MJCF, DH table or a preset.")],
    log: Annotated[
        Path,
        typer.Argument(
            help="Log whose velocity references or torques drive the run, or references of 'axisight excite'."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Parquet log to write.")],
    columns: Columns = None,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    torque: Annotated[
        bool,
        typer.Option("--torque", help="Drive with the torques of the log, without the controller."),
    ] = False,
    effect: GivenEffects = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLE,...",
            help="Driven joint angles at the start (rad). Default: the operating point.",
        ),
    ] = None,
    model: Annotated[
        str,
        typer.Option(
            rich_help_panel=INTEGRATION,
            help=f"Equations of the plant: {' or '.join(get_args(Model))}.",
        ),
    ] = "nonlinear",
    method: Annotated[
        str,
        typer.Option(
            rich_help_panel=INTEGRATION, help=f"Integrator: {', '.join(get_args(Method))}."
        ),
    ] = "dopri5",
    tolerance: Annotated[
        float,
        typer.Option(
            rich_help_panel=INTEGRATION, help="Relative local error; not of rk4 and rkn4."
        ),
    ] = 1e-7,
    substeps: Annotated[
        int, typer.Option(rich_help_panel=INTEGRATION, help="Steps per sample of rk4 and rkn4.")
    ] = 1,
    noise_seed: Annotated[
        int | None, typer.Option(rich_help_panel=SENSOR, help="Add sensor noise with this seed.")
    ] = None,
    run: Annotated[
        int, typer.Option(rich_help_panel=SENSOR, help="Number of the run; each has its own noise.")
    ] = 0,
    noise_cutoff_hz: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=SENSOR, help="Corner of a first-order noise spectrum. Default: white."
        ),
    ] = None,
    resolution: Annotated[
        float,
        typer.Option(rich_help_panel=SENSOR, help="Step of the position sensor (rad), motor side."),
    ] = 0.0,
    start_s: From = 0.0,
    stop_s: To = None,
    moving: Moving = False,
    experiment: Annotated[
        int | None, typer.Option(help="Of references with several: the one to simulate, from 1.")
    ] = None,
    each: Annotated[
        bool,
        typer.Option(
            "--each",
            help="Of references with several: simulate each experiment, into OUT-1.parquet, OUT-2.parquet, ... "
            "The noise is that of --run and the runs after it.",
        ),
    ] = False,
    periods: Annotated[int, typer.Option(help="Of references: how many of them.")] = 1,
    force: Force = False,
) -> None:
    """Simulate a robot along the references or torques of a log and write the result as a log."""
    with errors():
        given = [*files_of(log), Path(robot), *(x for x in (columns,) if x)]
        references = read_references(log) if holds_references(log) else None
        targets = _targets(out, references, experiment, each=each)
        check_targets(
            {_named(path, out): path for path in targets.values()},
            inputs=given,
            replaces=dict.fromkeys((_named(path, out) for path in targets.values()), (".parquet",)),
            force=force,
        )
        options = ModelOptions(base, tip, payload)
        load = partial(load_simulator, given=parse_effects(effect), options=options)
        use = Used(start_s, stop_s, moving)
        if references is not None:
            if torque or not use.whole:
                raise InputError(
                    f"--from, --to, --moving, --torque: expected a log, got references in {log}"
                )
            machine = _machine(log, references, robot, load)
            drives = [_designed(references, number, periods) for number in targets]
        elif experiment is not None or each or periods != 1:
            raise InputError(
                f"--experiment, --each, --periods: expected references, got the log {log}"
            )
        else:
            machine, (read,) = read_beside(robot, [log], columns, load, bare=options.load)
            drives = [_inputs(use.one_of(read), machine, torque=torque)]
        failed = False
        for k, (path, inputs) in enumerate(zip(targets.values(), drives, strict=True)):
            result = simulate(
                machine,
                torque_nm=inputs.get("torque_nm"),
                velocity_ref_rad_s=inputs.get("velocity_ref_rad_s"),
                start_rad=None if start is None else numbers("--start", start),
                model=cast(Model, model),
                method=cast(Method, method),
                tolerance=tolerance,
                substeps=substeps,
                noise_seed=noise_seed,
                run=run + k,
                noise_cutoff_hz=noise_cutoff_hz,
                position_resolution_rad=resolution,
            )
            write_bytes(path, _log_table(result, inputs).to_parquet(index=False))
            say(f"{result.attrs['status']}: {path}")
            failed |= result.attrs["status"] != "completed"
        if failed:
            raise typer.Exit(1)


def _named(path: Path, out: Path) -> str:
    """Return the option for an output, with the name of the file if the command chose it."""
    return "--out" if path == out else f"--out, {path.name}"


def _targets(
    out: Path, references: References | None, experiment: int | None, *, each: bool
) -> dict[int, Path]:
    """Return the log to write for each experiment (from 1) of references; one for a log as input.

    Raises InputError for a missing experiment, and if several are there and neither option says which.
    """
    if references is None:
        return {1: out}
    count = references.n_experiments
    if each:
        if experiment is not None:
            raise InputError("--each: expected without --experiment, got both")
        digits = len(str(count))
        return {
            e: out.with_name(f"{out.stem}-{e:0{digits}d}{out.suffix}") for e in range(1, count + 1)
        }
    if experiment is None and count == 1:
        experiment = 1
    if experiment is None or not 1 <= experiment <= count:
        raise InputError(
            f"--experiment: expected one of 1 to {count} of the references, or --each, got {experiment}"
        )
    return {experiment: out}


def _machine(path: Path, references: References, source: str, load: Callable[..., Robot]) -> Robot:
    """Return the robot. One from a model file gets the sample time of the references, unless its data state one.

    Raises InputError for references that are not speeds, and for another sample time.
    """
    robot = load(source, sample_time_s=references.sample_time_s if is_model_file(source) else None)
    if references.unit != "rad/s":
        raise InputError(f"{path}: expected velocity references in rad/s, got {references.unit}")
    _same_rate(path, references.sample_time_s, robot)
    return robot


def _designed(
    references: References, experiment: int, periods: int
) -> dict[str, NDArray[np.float64]]:
    """Return periods of an experiment (from 1) as the input of `simulate`."""
    if periods < 1:
        raise InputError(f"--periods: expected a positive number, got {periods}")
    return {"velocity_ref_rad_s": np.tile(references.period[experiment - 1], (periods, 1))}


def _inputs(log: Log, robot: Robot, *, torque: bool) -> dict[str, NDArray[np.float64]]:
    """Return the torques or speed references of the log as the input of `simulate`.

    Raises InputError for a log without references or with another sample time than the robot.
    """
    _same_rate(log.source, log.sample_time_s, robot)
    if torque:
        return {"torque_nm": log.torque_nm}
    if log.velocity_ref_rad_s is None:
        raise InputError(f"{log.source}: expected velocity references; --torque does without")
    return {"velocity_ref_rad_s": log.velocity_ref_rad_s}


def _same_rate(source: object, sample_time_s: float, robot: Robot) -> None:
    if abs(sample_time_s / robot.sample_time_s - 1) > _SAME_RATE:
        raise InputError(
            f"{source}: expected the sample time of the robot, {robot.sample_time_s:g} s, "
            f"got {sample_time_s:g} s; resample it or change the robot"
        )


def _log_table(result: xr.Dataset, inputs: dict[str, NDArray[np.float64]]) -> pd.DataFrame:
    """Return the run as a table with the native columns of a log."""
    data = {"time_s": np.asarray(result["time"].values)}
    reference = inputs.get("velocity_ref_rad_s")
    for i in range(result.sizes["axis"]):
        if reference is not None:
            data[f"velocity_ref_{i + 1}"] = reference[: result.sizes["time"], i]
        data[f"torque_cmd_{i + 1}"] = result["torque_cmd_nm"].values[:, i]
        data[f"position_{i + 1}"] = result["position_rad"].values[:, i]
    if "acceleration_m_s2" in result:
        for place in result["accelerometer"].values:
            for direction in result["direction"].values:
                found = result["acceleration_m_s2"].sel(accelerometer=place, direction=direction)
                if found.notnull().any():
                    data[f"acceleration_{place}_{direction}"] = found.values
    return pd.DataFrame(data)
