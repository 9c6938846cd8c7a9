"""The commands ``axisight robot``: make robot files from model files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from axisight.arguments import counted
from axisight.cli.common import Force, errors, say
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.robot import say_import
from axisight.cli.screen import is_output
from axisight.errors import InputError
from axisight.robot_import import import_robot
from axisight.storage import check_targets, write_whole

robot_app = typer.Typer(no_args_is_help=True, add_completion=False)


@robot_app.callback()
def _robot() -> None:
    """Make robot files of URDF, MJCF and tables of Denavit and Hartenberg."""


@robot_app.command("import")
def import_command(
    model: Annotated[
        Path, typer.Argument(help="URDF, MJCF, or a table of Denavit and Hartenberg (CSV or TOML).")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Robot file to write. Default: the screen.")
    ] = None,
    base: Base = None,
    tip: Tip = None,
    drives: Annotated[
        Path | None,
        typer.Option(
            help="Gear ratios, rotors, controller, sample time (TOML). Default: MODEL.drives.toml "
            "beside the model, if there is one."
        ),
    ] = None,
    payload: Load = None,
    whole_tree: Annotated[
        bool,
        typer.Option(
            "--whole-tree",
            help="Take all moving branches. Joints that follow other joints are locked at zero.",
        ),
    ] = False,
    floating: Annotated[
        bool,
        typer.Option(
            "--floating",
            help="Give the robot a floating base: --base, else the body on the free joint, else the root.",
        ),
    ] = False,
    force: Force = False,
) -> None:
    """Write a model file as a robot file, and say what could not be taken along."""
    with errors():
        out = None if is_output(out) else out
        given = [model, *(x for x in (drives,) if x)]
        check_targets({"-o": out}, inputs=given, replaces={"-o": ()}, force=force)
        if whole_tree and tip:
            raise InputError(f"--whole-tree: expected no --tip beside it, got --tip {tip[0]}")
        data = ModelOptions(base, tip, payload).drives(model, drives)
        robot = import_robot(model, drives=data, whole_tree=whole_tree, floating=floating)
        if out is None:
            typer.echo(robot.toml, nl=False)
            return
        write_whole(out, robot.toml)
        say(f"{out}: {counted(robot.n_axes, 'axis', 'axes')}, {', '.join(robot.axis_names)}")
        say_import(robot)
