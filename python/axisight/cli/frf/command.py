"""The command ``axisight frf``: its options, and what it does in which order."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import Columns, Force, From, To, errors, numbers
from axisight.cli.frf.files import Targets, write_figure, write_response
from axisight.cli.frf.words import show
from axisight.cli.identify_common import (
    DropPeriods,
    PeriodS,
    Unchecked,
    as_options,
    band,
    options,
    read_logs,
)
from axisight.cli.panels import ESTIMATE, EXCITATION
from axisight.cli.robot import axis_of
from axisight.errors import InputError
from axisight.excitation import References, read_references
from axisight.frf.quantity import RATES, Quantity
from axisight.gap.prepare.used_part import Used
from axisight.logs.sources import files_of
from axisight.responses import ESTIMATORS, MEANS, response_of_logs
from axisight.robot import Robot, load_robot


def frf_command(
    ctx: typer.Context,
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="Logs of one operating point: one for each experiment, or several experiments in one log."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="NetCDF file to write (.nc), which 'axisight identify elastic' reads.",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="robot.toml, URDF, MJCF or a preset: its gear ratios give the operating point."
        ),
    ] = None,
    columns: Columns = None,
    design: Annotated[
        Path | None,
        typer.Option(
            help="References of 'axisight excite': period, excited lines and free lines. Default: found."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLE,...",
            help="Operating point: angles of the driven joints (rad). Default: their mean in the logs.",
        ),
    ] = None,
    axes: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS,...",
            help="Axes to estimate, numbers or joint names (with --robot). Default: all that move.",
        ),
    ] = None,
    quantity: Annotated[
        str,
        typer.Option(
            rich_help_panel=ESTIMATE, help=f"Motor motion: {', '.join(RATES)}, by motor torque."
        ),
    ] = "acceleration",
    estimator: Annotated[
        str,
        typer.Option(
            rich_help_panel=ESTIMATE,
            help=f"{', '.join(ESTIMATORS[:-1])} or {ESTIMATORS[-1]}, also with hyphens.",
        ),
    ] = "auto",
    average: Annotated[
        str | None,
        typer.Option(
            rich_help_panel=ESTIMATE,
            help=f"Mean over realizations: {', '.join(MEANS)}. Default: logarithmic if there are several.",
        ),
    ] = None,
    bandwidth_hz: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=ESTIMATE,
            help="Half width of the window of the estimator spectral (Hz).",
        ),
    ] = None,
    period_s: PeriodS = None,
    band_hz: Annotated[
        str | None,
        typer.Option(
            metavar="LOW,HIGH",
            rich_help_panel=EXCITATION,
            help="Band to estimate (Hz). Default: all excited lines.",
        ),
    ] = None,
    drop_periods: DropPeriods = None,
    start_s: From = 0.0,
    stop_s: To = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw the response with its noise and distortion here (.png, .pdf or .svg)."
        ),
    ] = None,
    unchecked: Unchecked = False,
    force: Force = False,
) -> None:
    """Estimate the frequency response of a robot from the logs of one operating point.

    The response leads from motor torques to motor motions. Prints what was chosen and why, what is noise, what
    is distortion, and which lines are weak. --out writes the response with variance and operating point.
    """
    with errors(), as_options(ctx):
        targets = Targets(out, plot)
        read = [part for log in logs for part in files_of(log)]
        targets.check([*read, *(p for p in (columns, design) if p is not None)], force=force)
        machine = None if robot is None else load_robot(robot)
        found = response_of_logs(
            read_logs(
                logs,
                columns,
                machine,
                unchecked=unchecked,
                used=Used(start_s, stop_s),
                broadband=True,
            ),
            robot=machine,
            design=None if design is None else _design(design),
            estimator=estimator.replace("-", "_"),
            average=average,
            quantity=_quantity(quantity),
            axes=None if axes is None else _axes(axes, machine),
            operating_point_rad=None if at is None else numbers("--at", at),
            period_s=period_s,
            band_hz=band("--band-hz", band_hz),
            bandwidth_hz=bandwidth_hz,
            drop_periods=drop_periods,
        )
        show(found)
        if out is not None:
            inputs = [*logs, *(() if design is None else (design,))]
            write_response(found, out, inputs, columns, options(ctx))
        if plot is not None:
            write_figure(found, plot)


def _design(path: Path) -> References:
    try:
        return read_references(path)
    except InputError as error:
        raise InputError(f"--design: {error}") from None


def _quantity(text: str) -> Quantity:
    for quantity in RATES:
        if text == quantity:
            return quantity
    raise InputError(f"--quantity: expected {', '.join(RATES)}, got {text!r}")


def _axes(text: str, machine: Robot | None) -> list[int]:
    parts = text.split(",")
    if machine is not None:
        return [axis_of(part, machine, "--axes") for part in parts]
    if not all(part.isdecimal() for part in parts):
        raise InputError(
            f"--axes: expected numbers from 1, or joint names and the robot in --robot, got {text!r}"
        )
    return [int(part) for part in parts]
