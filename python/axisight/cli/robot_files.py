"""The commands ``axisight robot``: robot files from the model files that people have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import Force, errors, say
from axisight.cli.robot import say_import
from axisight.cli.screen import is_output
from axisight.errors import InputError
from axisight.robot_import import import_robot
from axisight.robot_import.drives import Payload
from axisight.robot_import.load import drive_data
from axisight.storage import check_targets, write_whole

robot_app = typer.Typer(no_args_is_help=True, add_completion=False)


@robot_app.callback()
def _robot() -> None:
    """Make robot files of URDF, MJCF and tables of Denavit and Hartenberg."""


@robot_app.command("import")
def import_command(
    model: Annotated[
        Path, typer.Argument(help="URDF, MJCF, or a table of Denavit and Hartenberg (CSV).")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Robot file to write. Default: the screen.")
    ] = None,
    base: Annotated[
        str | None, typer.Option(help="Link that stands still. Default: the root.")
    ] = None,
    tip: Annotated[
        str | None,
        typer.Option(
            help="Last link of the chain; other moving branches are locked at zero. Default: the end "
            "of the only moving branch."
        ),
    ] = None,
    drives: Annotated[
        Path | None,
        typer.Option(
            help="Gear ratios, rotors, controller, sample time (TOML). Default: MODEL.drives.toml "
            "beside the model, if there is one."
        ),
    ] = None,
    payload: Annotated[
        str | None,
        typer.Option(
            metavar="KG[,X,Y,Z]",
            help="Load mounted by hand: mass, and its centre in the frame of the last link [m].",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Write a model file as a robot file, and say what could not be taken along."""
    with errors():
        out = None if is_output(out) else out
        given = [model, *(x for x in (drives,) if x)]
        check_targets({"-o": out}, inputs=given, replaces={"-o": ()}, force=force)
        data = drive_data(model, drives)
        if payload is not None:
            data = data.model_copy(update={"payload": _payload(payload)})
        robot = import_robot(model, base=base, tip=tip, drives=data)
        if out is None:
            typer.echo(robot.toml, nl=False)
            return
        write_whole(out, robot.toml)
        say(f"{out}: {robot.n_axes} axes, {', '.join(robot.axis_names)}")
        say_import(robot)


def _payload(text: str) -> Payload:
    try:
        mass, *com = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--payload: expected KG or KG,X,Y,Z, got {text!r}") from None
    if len(com) not in (0, 3) or not mass > 0:
        raise InputError(f"--payload: expected KG or KG,X,Y,Z with a positive mass, got {text!r}")
    x, y, z = com or (0.0, 0.0, 0.0)
    return Payload(mass=mass, com=(x, y, z))
