"""The command ``axisight repeat``."""

from __future__ import annotations

import io
import json as documents
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import (
    Columns,
    Force,
    From,
    Moving,
    To,
    TorqueMeasured,
    errors,
    say,
    write_each,
    write_text,
)
from axisight.cli.identify_common import Unchecked, as_options, read_logs
from axisight.cli.panels import COMPARED, OUTPUT
from axisight.cli.repeat_words import show
from axisight.cli.screen import is_output
from axisight.errors import InputError
from axisight.gap.prepare.used_part import Used
from axisight.logs.sources import files_of
from axisight.repeats import DayComparison, compare_days, days_of, plot_days
from axisight.robot import load_robot
from axisight.storage import check_targets, write_bytes

_PICTURES = (".png", ".pdf", ".svg")


def repeat_command(
    ctx: typer.Context,
    logs: Annotated[
        list[Path],
        typer.Argument(help="Runs of one motion in their order in time, two or more of each day."),
    ],
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="robot.toml, URDF, MJCF or a preset: its mechanics tell a load from friction. Default: each "
            "axis alone.",
        ),
    ] = None,
    by: Annotated[
        str,
        typer.Option(
            metavar="folder|PATTERN",
            help="Day of a log: its folder, or the place of {day} in its file name, as in '{day}_run*'.",
        ),
    ] = "folder",
    reference: Annotated[
        str | None,
        typer.Option(
            metavar="DAY", help="Day that changes refer to. Default: that of the first log."
        ),
    ] = None,
    columns: Columns = None,
    json: Annotated[
        Path | None, typer.Option(help="Write the comparison here as JSON; - for standard output.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw the parameters over the days here (.png, .pdf or .svg)."),
    ] = None,
    cutoff_hz: Annotated[
        float,
        typer.Option(
            rich_help_panel=COMPARED,
            help="Low-pass (Hz): well above the motion, well below the first resonance.",
        ),
    ] = 10.0,
    reversal_s: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=COMPARED,
            help="Time around each reversal that is left out of the regressions (s). Default: two periods of "
            "--cutoff-hz.",
        ),
    ] = None,
    torque_measured: TorqueMeasured = False,
    level: Annotated[
        float,
        typer.Option(
            rich_help_panel=COMPARED, help="Probability of any false finding among all tests."
        ),
    ] = 0.05,
    places: Annotated[
        bool,
        typer.Option(
            "--places",
            rich_help_panel=OUTPUT,
            help="Print the scatter by direction, speed, time and frequency band.",
        ),
    ] = False,
    unchecked: Unchecked = False,
    force: Force = False,
    start_s: From = 0.0,
    stop_s: To = None,
    moving: Moving = False,
) -> None:
    """Compare runs of one motion over days: which parameter moved, and what is chance.

    Prints friction, offset and load parameters of every day with intervals that allow for the scatter from
    run to run, the smallest change that these runs would show, and the floor. The exit status is 1 if
    something moved.
    """
    with errors(), as_options(ctx):
        _check(logs, columns, json, plot, force=force)
        machine = None if robot is None else load_robot(robot)
        days = days_of(logs, by)
        used = Used(start_s, stop_s, moving)
        found = compare_days(
            read_logs(logs, columns, machine, unchecked=unchecked, used=used),
            days,
            robot=machine,
            reference=reference,
            cutoff_hz=cutoff_hz,
            reversal_s=reversal_s,
            torque_held=not torque_measured,
            level=level,
        )
        show(found, places=places)
        _write(found, json, plot)
        if found.moved:
            raise typer.Exit(1)


def _check(
    logs: list[Path], columns: Path | None, json: Path | None, plot: Path | None, *, force: bool
) -> None:
    """Raise InputError or OutputError before any work for files that could not be written."""
    if plot is not None and plot.suffix not in _PICTURES:
        raise InputError(f"--plot: expected a name ending in {', '.join(_PICTURES)}, got {plot}")
    inputs = [*(part for log in logs for part in files_of(log)), *(x for x in (columns,) if x)]
    check_targets(
        {"--json": None if json is None or is_output(json) else json, "--plot": plot},
        inputs=inputs,
        replaces={"--json": (".json",), "--plot": _PICTURES},
        force=force,
    )


def _write(found: DayComparison, json: Path | None, plot: Path | None) -> None:
    def document(target: Path) -> None:
        write_text(target, documents.dumps(found.to_dict(), indent=2, allow_nan=False) + "\n")
        if not is_output(target):
            say(f"written: {target}")

    def picture(target: Path) -> None:
        drawn = io.BytesIO()
        plot_days(found).savefig(drawn, dpi=200, format=target.suffix.removeprefix("."))
        write_bytes(target, drawn.getvalue())
        say(f"written: {target}")

    wanted = ((document, json), (picture, plot))
    write_each([partial(write, target) for write, target in wanted if target is not None])
