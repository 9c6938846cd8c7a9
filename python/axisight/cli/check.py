"""The command ``axisight check``: check a log alone, and together with a robot."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import Columns, MaxBytes, Untrusted, errors, say
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.robot import load_simulator
from axisight.cli.screen import OUT
from axisight.cli.suggest import suggestion
from axisight.errors import InputError, LogError
from axisight.gap import Finding
from axisight.gap.facts.faults import refused
from axisight.gap.intake.inputs import read_beside
from axisight.gap.intake.preview import look_beside
from axisight.logs import LogReport, check_log, render
from axisight.logs.map_files import AnyMap
from axisight.logs.mending import mending_line
from axisight.logs.untrusted import check_log_inside


def check_command(
    log: Annotated[Path, typer.Argument(help="Log to check.")],
    columns: Columns = None,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="Simulator (robot.toml, URDF, MJCF or a preset): also say what a diagnosis would refuse.",
        ),
    ] = None,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    untrusted: Untrusted = False,
    max_bytes: MaxBytes = None,
) -> None:
    """Check a log: rate, gaps, NaN, saturation, quantization, units, constant channels.

    The exit status is 1 where a diagnosis would refuse the log.
    """
    with errors():
        options = ModelOptions(base, tip, payload)
        if robot is None and options.given():
            raise InputError(
                f"{', '.join(options.given())}: expected --robot MODEL beside it, got none"
            )
        if untrusted:
            check_log_inside(log)
        found = check_log(log, columns, max_bytes=max_bytes)
        show_report(found)
        good = found.ok and (robot is None or fits(robot, options, found, columns, max_bytes))
        if not good:
            raise typer.Exit(1)


def show_report(found: LogReport) -> None:
    """Print the report on a log, and the name that was probably meant for one that is missing."""
    OUT.print(render(found))
    wrong = (item.message for item in found.findings if item.severity == "error")
    near = next(filter(None, map(suggestion, wrong)), None)
    if near is not None:
        say(f"Did you mean {near}?")


def fits(
    model: str,
    options: ModelOptions,
    alone: LogReport,
    columns: AnyMap | Path | None,
    max_bytes: int | None,
) -> bool:
    """Print what a diagnosis would refuse, flag and compare; return False if it would refuse the log."""
    load = partial(load_simulator, options=options)
    try:
        robot, (log,) = read_beside(
            model,
            [alone.path],
            columns,
            load,
            bare=options.load,
            max_bytes=max_bytes,
            currents=True,
        )
    except LogError as error:
        say(f"refused: {error}")
        return False
    try:
        beside = look_beside(robot, log)
    except InputError as error:
        say(f"refused: {error}")
        return False
    for finding in beside.findings:
        if not _told(finding, alone):
            say(f"{'refused' if finding.severity == 'refuse' else 'flagged'}: {finding}")
            mend = mending_line(finding.name, finding.axis, finding.field)
            if mend is not None:
                say(f"  {mend}")
    if refused(beside.findings):
        say(f"a diagnosis with {model} would be refused")
        return False
    say(f"beside {model}: {beside.compared}")
    return True


def _told(finding: Finding, alone: LogReport) -> bool:
    """Whether the report on the log alone already shows a flag; refusals are always printed again."""
    return finding.severity == "flag" and any(
        seen.severity != "ok" and seen.axis == finding.axis and seen.message in finding.message
        for seen in alone.findings
    )
