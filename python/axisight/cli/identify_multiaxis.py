"""The command ``axisight identify multiaxis``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

import axisight
from axisight.cli.common import Columns, Force, errors, numbers, say
from axisight.cli.identify_common import (
    DropPeriods,
    ExcitedBand,
    Out,
    PeriodS,
    Unchecked,
    as_options,
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
from axisight.cli.panels import EXCITATION, MODEL, SEARCH
from axisight.errors import InputError
from axisight.graybox.multiaxis.procedure import USUAL_PARAMETERS
from axisight.logs import Load, Log

_CONVERGED = ("loss_converged", "step_converged", "exact")


def multiaxis_command(
    ctx: typer.Context,
    robot: Annotated[str, typer.Argument(help="robot.toml or a preset: where the search starts.")],
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="Logs of periodic excitation, from rest: at each pose as many as the arm has axes."
        ),
    ],
    slow: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="LOG", help="Log of slow motions both ways, for friction (repeatable)."
        ),
    ] = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            help="Robot parameter to fit, by name or with wildcards (repeatable), e.g. "
            "'axis*.stiffness'. Default: stiffness, damping, motor inertia and viscous friction of all."
        ),
    ] = None,
    out: Out = None,
    columns: Columns = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LOG=KG,X,Y,Z",
            help="Load of a log, by the name of its file without ending: mass (kg) and centre of mass "
            "(m) in the frame of the last link (repeatable).",
        ),
    ] = None,
    period_s: PeriodS = None,
    band_hz: ExcitedBand = None,
    drop_periods: DropPeriods = None,
    cutoff_hz: Annotated[
        float, typer.Option(rich_help_panel=EXCITATION, help="Low-pass on slow motions (Hz).")
    ] = 10.0,
    bodies: Annotated[
        bool,
        typer.Option(
            "--bodies",
            rich_help_panel=MODEL,
            help="Replace masses and inertias, too, by those that the slow logs show.",
        ),
    ] = False,
    no_coulomb: Annotated[
        bool,
        typer.Option(
            "--no-coulomb", rich_help_panel=MODEL, help="Give no axis a Coulomb friction."
        ),
    ] = False,
    no_responses: Annotated[
        bool,
        typer.Option(
            "--no-responses",
            rich_help_panel=SEARCH,
            help="Start from the values of ROBOT, without frequency responses.",
        ),
    ] = False,
    seed: Annotated[
        int, typer.Option(rich_help_panel=SEARCH, help="Seed of the random starts.")
    ] = 0,
    unchecked: Unchecked = False,
    force: Force = False,
) -> None:
    """All axes in three steps: friction, frequency responses, fit of all logs in the time domain.

    Prints the values of each step with standard errors, the fit of each log and findings. --out writes the
    robot with these values and their Coulomb friction. The exit status is 1 if the fit did not converge.
    """
    with errors(), as_options(ctx):
        files = [*(slow or []), *logs]
        check_out(out, files, columns, force=force)
        machine = load_source(robot)
        read = _loaded(read_logs(files, columns, machine, unchecked=unchecked), load or [])
        calm = len(slow or [])
        found = axisight.graybox.identify_robot(
            machine,
            read[calm:],
            slow=read[:calm],
            parameters=parameters or USUAL_PARAMETERS,
            coulomb=not no_coulomb,
            bodies=bodies,
            responses=not no_responses,
            period_s=period_s,
            lines=lines_of_band(band_hz, period_s),
            drop_periods=drop_periods,
            cutoff_hz=cutoff_hz,
            seed=seed,
        )
        say(option_words(found.report(), option_names(ctx)))
        if out is not None:
            fitted = list(found.joint.fit.names)
            source = provenance("multiaxis", files, options(ctx) | {"parameters": fitted}, columns)
            write_robot(machine, out, axisight.graybox.identified_robot(found, source), force=force)
        if found.status not in _CONVERGED:
            raise typer.Exit(1)


def _loaded(logs: Sequence[Log], given: Sequence[str]) -> list[Log]:
    """Return the logs with the loads of LOG=KG,X,Y,Z texts."""
    loads: dict[str, Load] = {}
    for text in given:
        name, equals, rest = text.partition("=")
        values = numbers(f"--load {name}", rest) if equals else []
        if len(values) != 4 or name in loads:
            raise InputError(f"--load: expected LOG=KG,X,Y,Z, once for each log, got {text!r}")
        loads[name] = Load(values[0], (values[1], values[2], values[3]))
    for name in loads:
        if name not in {log.name for log in logs}:
            known = ", ".join(log.name for log in logs)
            raise InputError(f"--load: expected a log of {known}, got {name!r}")
    return [replace(log, load=loads.get(log.name, log.load)) for log in logs]
