"""The command ``axisight identify elastic``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import numpy as np
import typer
import xarray as xr
from rich.markup import escape
from rich.table import Table

import axisight
from axisight.cli.common import Force, errors, numbers, say
from axisight.cli.identify_common import (
    Out,
    as_options,
    check_out,
    load_source,
    options,
    pairs,
    provenance,
    write_robot,
)
from axisight.cli.panels import SEARCH
from axisight.cli.screen import OUT
from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.fitting import robot_parameters
from axisight.frf.interop import load_netcdf
from axisight.responses.operating_point import (
    GEAR_ANGLE,
    GEAR_TORQUE,
    OPERATING_POINT,
    joint_angles,
)
from axisight.robot import Robot

if TYPE_CHECKING:
    from axisight.frequency_fit import FrequencyFit, FrequencyFitOptions
    from axisight.frequency_fit.measured import Sampling
    from axisight.frequency_fit.options import Criterion

Data = list[tuple[list[float], xr.Dataset]]
_USUAL = ("*.stiffness", "*.damping")
# Change of an operating point (rad) that no response shows.
_SAME_POSE_RAD = 1e-5
_CONVERGED = ("loss_converged", "step_converged", "exact")


def elastic_command(
    ctx: typer.Context,
    robot: Annotated[str, typer.Argument(help="robot.toml or a preset: where the search starts.")],
    responses: Annotated[
        list[Path],
        typer.Argument(
            help="Frequency responses, one per operating point (NetCDF, of 'axisight frf')."
        ),
    ],
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            help="Parameter to fit, by name or with wildcards (repeatable), e.g. "
            "'axis*.stiffness'. Default: all stiffnesses and dampings."
        ),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ANGLE,...",
            help="Operating point of each response in turn: angles of the driven joints (rad). "
            f"Default: the attribute {OPERATING_POINT} of the files.",
        ),
    ] = None,
    out: Out = None,
    start: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Start value of a parameter, by name or with wildcards (repeatable), e.g. "
            "'axis*.stiffness=2e6'. Default: that of the robot.",
        ),
    ] = None,
    criterion: Annotated[
        str,
        typer.Option(
            rich_help_panel=SEARCH,
            help="(weighted_)log_least_squares compares logarithms, (weighted_)least_squares values.",
        ),
    ] = "weighted_log_least_squares",
    sampling: Annotated[
        str,
        typer.Option(
            rich_help_panel=SEARCH, help="zero_order_hold, as a sampled loop has it, or continuous."
        ),
    ] = "zero_order_hold",
    robust: Annotated[
        bool,
        typer.Option(
            "--robust",
            rich_help_panel=SEARCH,
            help="Give less weight to lines that the model misses (Huber).",
        ),
    ] = False,
    starts: Annotated[
        int,
        typer.Option(
            rich_help_panel=SEARCH, help="Number of searches; all but the first begin at random."
        ),
    ] = 1,
    seed: Annotated[
        int, typer.Option(rich_help_panel=SEARCH, help="Seed of the random starts.")
    ] = 0,
    force: Force = False,
) -> None:
    """Stiffness and damping of gears and links from frequency responses at several poses.

    Prints values with standard errors and 95 % intervals, and warnings. The exit status is 1 if the
    search did not converge.
    """
    with errors(), as_options(ctx):
        check_out(out, responses, force=force)
        machine = load_source(robot)
        linear = [
            effect for effect in machine.effects if effect_info(effect.name).linear == "parameters"
        ]
        model = machine.with_effects(linear)
        begin = _starts(machine, parameters or list(_USUAL), pairs("--start", start))
        data = _responses(machine.with_parameters(begin), responses, at)
        search = axisight.frequency_fit.FrequencyFitOptions(
            criterion=cast("Criterion", criterion),
            sampling=cast("Sampling", sampling),
            loss="huber" if robust else "squared",
            starts=starts,
            seed=seed,
        )
        fit, data = _fit(model, data, begin, search, moves=not at)
        _show(fit)
        if len(linear) < len(machine.effects):
            left = ", ".join(e.label for e in machine.effects if e not in linear)
            say(f"not in the linear model, kept as they are: {left}")
        if out is not None:
            # Record the parameters and angles themselves, not the patterns and files that gave them.
            settings = options(ctx) | {
                "parameters": list(begin),
                "start": begin,
                "operating_points_rad": [list(angles) for angles, _ in data],
            }
            source = provenance("elastic", responses, settings)
            found = axisight.frequency_fit.identified_responses(fit, source)
            write_robot(machine, out, found, force=force)
        if fit.status not in _CONVERGED:
            raise typer.Exit(1)


def _fit(
    model: Robot,
    data: Data,
    begin: dict[str, float],
    search: FrequencyFitOptions,
    *,
    moves: bool,
) -> tuple[FrequencyFit, Data]:
    """Return the fit and the responses with their operating points.

    ``moves``: operating points from motor angles depend on gear stiffnesses. Where the fit changes them, the
    points move, and a second search starts from the first one's values.
    """
    fit = axisight.frequency_fit.fit_responses(model, data, begin, options=search)
    moved = [(_joint_angles(fit.robot, response) or pose, response) for pose, response in data]
    change = np.max([np.abs(np.subtract(a, b)) for (a, _), (b, _) in zip(moved, data, strict=True)])
    if not moves or change < _SAME_POSE_RAD:
        return fit, data
    again = replace(search, starts=1)
    fit = axisight.frequency_fit.fit_responses(
        model, moved, dict(zip(fit.names, fit.values.tolist(), strict=True)), options=again
    )
    say(
        f"operating points moved by up to {1e3 * change:.2g} mrad, as gears deflect less or more with the "
        "stiffnesses found; fitted again"
    )
    return fit, moved


def _joint_angles(robot: Robot, response: xr.Dataset) -> list[float] | None:
    """Return the operating point with the gear stiffnesses of a robot; None if the response states it alone."""
    if GEAR_ANGLE not in response.attrs or GEAR_TORQUE not in response.attrs:
        return None
    angle, torque = (np.atleast_1d(response.attrs[name]) for name in (GEAR_ANGLE, GEAR_TORQUE))
    return [float(x) for x in joint_angles(robot, angle, torque)]


def _responses(robot: Robot, paths: Sequence[Path], at: Sequence[str] | None) -> Data:
    poses = [numbers("--at", text) for text in at or []]
    if poses and len(poses) != len(paths):
        raise InputError(f"--at: expected one for each of {len(paths)} responses, got {len(poses)}")
    out = []
    for i, path in enumerate(paths):
        response = load_netcdf(path)
        if not poses and OPERATING_POINT not in response.attrs:
            raise InputError(
                f"{path}: operating point: expected --at ANGLE,... once for each response, or the attribute "
                f"{OPERATING_POINT} of the file, got neither"
            )
        pose = poses[i] if poses else _stated(robot, response)
        if len(pose) != robot.n_axes:
            raise InputError(
                f"{path}: operating point: expected {robot.n_axes} angles of driven joints, got "
                f"{len(pose)}"
            )
        out.append((pose, response))
    return out


def _stated(robot: Robot, response: xr.Dataset) -> list[float]:
    """Return the operating point that a response states, with the gears of the robot if it depends on them."""
    pose: list[float] = np.atleast_1d(response.attrs[OPERATING_POINT]).tolist()
    found = _joint_angles(robot, response) if len(pose) == robot.n_axes else None
    return pose if found is None else found


def _starts(robot: Robot, patterns: Sequence[str], given: dict[str, float]) -> dict[str, float]:
    """Return the parameters that match the patterns, with start values, in the order of the robot."""
    known = robot_parameters(robot)
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in known):
            raise InputError(
                f"--parameters: expected names or patterns of {', '.join(known)}, got {pattern!r}"
            )
    names = [name for name in known if any(fnmatchcase(name, p) for p in patterns)]
    begin = {name: known[name] for name in names}
    for pattern, value in given.items():
        meant = [name for name in names if fnmatchcase(name, pattern)]
        if not meant:
            raise InputError(
                f"--start: expected names or patterns of {', '.join(names)}, got {pattern!r}"
            )
        begin |= dict.fromkeys(meant, value)
    return begin


def _show(fit: FrequencyFit) -> None:
    table = Table()
    for title in ("parameter", "value", "std. error", "rel.", "95 % interval"):
        table.add_column(title, justify="left" if title == "parameter" else "right")
    for row in fit.table().itertuples():
        table.add_row(
            escape(str(row.parameter)),
            f"{row.value:.6g}",
            f"{row.std:.2g}",
            f"{100 * cast(float, row.relative_std):.2g} %",
            f"{row.lower:.5g} .. {row.upper:.5g}",
        )
    OUT.print(table)
    say(
        f"status {fit.status} after {fit.iterations} iterations, misfit {fit.misfit:.3g} (1 if "
        f"model and uncertainty are right), standard errors from the {fit.std_from}"
    )
    for text in fit.warnings:
        say(f"warning: {text}")
