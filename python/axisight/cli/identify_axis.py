"""The command ``axisight identify axis``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

import axisight
from axisight.cli.common import Columns, Force, errors, say
from axisight.cli.identify_common import (
    DropPeriods,
    ExcitedBand,
    Out,
    PeriodS,
    Unchecked,
    as_options,
    band,
    check_out,
    load_source,
    option_names,
    option_words,
    options,
    provenance,
    read_logs,
    write_robot,
)
from axisight.cli.lines import lines_of_band
from axisight.cli.panels import EXCITATION, MODEL
from axisight.cli.robot import axis_of
from axisight.errors import InputError
from axisight.robot import Robot

if TYPE_CHECKING:
    from axisight.graybox.prediction_error import NoiseKind


def axis_command(
    ctx: typer.Context,
    slow: Annotated[
        Path, typer.Argument(help="Log of a slow motion both ways, e.g. a triangle wave.")
    ],
    broadband: Annotated[
        list[Path],
        typer.Argument(help="Logs of periodic excitation, from rest, of different amplitudes."),
    ],
    robot: Annotated[
        str | None,
        typer.Option(help="robot.toml or a preset: has the gear ratio, and is what --out writes."),
    ] = None,
    gear_ratio: Annotated[
        float | None,
        typer.Option(
            help="Joint angle per motor angle, 0.00446 for a gear of 224:1. Default: that of --robot."
        ),
    ] = None,
    axis: Annotated[
        str,
        typer.Option(
            metavar="AXIS", help="Number of the axis, from 1; or a joint name, with --robot."
        ),
    ] = "1",
    out: Out = None,
    columns: Columns = None,
    period_s: PeriodS = None,
    band_hz: ExcitedBand = None,
    drop_periods: DropPeriods = None,
    cutoff_hz: Annotated[
        float, typer.Option(rich_help_panel=EXCITATION, help="Low-pass on the slow motion (Hz).")
    ] = 5.0,
    notch_band_hz: Annotated[
        str | None,
        typer.Option(
            metavar="LOW,HIGH",
            rich_help_panel=EXCITATION,
            help="Band in which to look for the notch (Hz).",
        ),
    ] = None,
    plateau_from_hz: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=EXCITATION, help="Frequency above which the response is flat (Hz)."
        ),
    ] = None,
    masses: Annotated[
        int, typer.Option(rich_help_panel=MODEL, help="Number of masses, 2 to 4, with the motor.")
    ] = 2,
    stribeck: Annotated[
        bool,
        typer.Option(
            "--stribeck", rich_help_panel=MODEL, help="Friction rises towards standstill."
        ),
    ] = False,
    backlash: Annotated[
        bool, typer.Option("--backlash", rich_help_panel=MODEL, help="The gear has play.")
    ] = False,
    offset: Annotated[
        bool,
        typer.Option("--offset", rich_help_panel=MODEL, help="The torque has a constant offset."),
    ] = False,
    smoothing_rad_s: Annotated[
        float,
        typer.Option(
            rich_help_panel=MODEL,
            help="Motor speed over which friction changes sign (rad/s); 0 is a step.",
        ),
    ] = 0.0,
    fixed: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            rich_help_panel=MODEL,
            help="Parameter that keeps its initial value (repeatable).",
        ),
    ] = None,
    noise_model: Annotated[
        str,
        typer.Option(rich_help_panel=MODEL, help="Noise model: output_error, innovations or ar."),
    ] = "output_error",
    open_loop: Annotated[
        bool,
        typer.Option(
            "--open-loop",
            rich_help_panel=MODEL,
            help="The logs were recorded without a controller.",
        ),
    ] = False,
    unchecked: Unchecked = False,
    force: Force = False,
) -> None:
    """One axis in three steps: rigid body and friction, flexibility, prediction-error fit.

    Prints the values of each step with standard errors, fits, residual tests and findings. --out
    writes the robot with gear stiffness and damping, motor inertia and friction of the
    axis. The exit status is 1 if the fit did not converge.
    """
    with errors(), as_options(ctx):
        check_out(out, [slow, *broadband], columns, force=force)
        machine = None if robot is None else load_source(robot)
        if out is not None and machine is None:
            raise InputError(
                "--out: expected --robot ROBOT, into which the values are written, got none"
            )
        number = _number(axis, machine)
        ratio = _ratio(machine, gear_ratio, number)
        files = [slow, *broadband]
        logs = read_logs(files, columns, machine, unchecked=unchecked)
        found = axisight.graybox.identify_axis(
            logs[0],
            logs[1:],
            gear_ratio=ratio,
            axis=number,
            model=axisight.graybox.AxisModel(
                n_masses=masses,
                gear_ratio=ratio,
                stribeck=stribeck,
                backlash=backlash,
                torque_offset=offset,
                friction_smoothing_rad_s=smoothing_rad_s,
                output="velocity_difference",
            ),
            fixed=fixed or [],
            noise_model=cast("NoiseKind", noise_model),
            closed_loop=not open_loop,
            period_s=period_s,
            lines=lines_of_band(band_hz, period_s),
            drop_periods=drop_periods,
            cutoff_hz=cutoff_hz,
            notch_band_hz=band("--notch-band-hz", notch_band_hz),
            plateau_from_hz=plateau_from_hz,
        )
        say(option_words(found.report(), option_names(ctx)))
        if machine is not None:
            against = axisight.graybox.compare_with_robot(found.fit, machine, number)
            for text in against.findings:
                say(f"- {text}")
            if out is not None and against.one_factor and not unchecked:
                raise InputError(
                    f"--out: nothing was written, for {against.findings[0]} (or write with "
                    "--unchecked)"
                )
        if out is not None and machine is not None:
            source = provenance("axis", files, options(ctx) | {"axis": number}, columns)
            values = axisight.graybox.identified_axis(found.fit, machine, source, axis=number)
            write_robot(machine, out, values, force=force)
            say(values.provenance.notes)
        if not found.fit.converged:
            raise typer.Exit(1)


def _number(axis: str, machine: Robot | None) -> int:
    """Return the number (from 1) of an axis given by number, or by joint name if there is a robot."""
    if machine is not None:
        return axis_of(axis, machine, "--axis")
    if not axis.isdecimal() or int(axis) < 1:
        raise InputError(
            f"--axis: expected a number from 1, or a joint name and the robot in --robot, got {axis!r}"
        )
    return int(axis)


def _ratio(machine: Robot | None, given: float | None, axis: int) -> float:
    if given is not None:
        if not 0 < given <= 1:
            raise InputError(
                f"--gear-ratio: expected joint angle per motor angle, 1/224 for a gear of 224:1, "
                f"got {given}"
            )
        return given
    if machine is None:
        raise InputError(
            "--gear-ratio: expected joint angle per motor angle, or --robot ROBOT that has it, got neither"
        )
    # Motor-side data do not show the direction in which the joint turns.
    return abs(float(machine.gear_ratio[axis - 1]))
