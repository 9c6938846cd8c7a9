"""The commands ``axisight columns``: list and show shipped column maps, and guess one for a log."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import Force, errors, say
from axisight.cli.model_options import Base, ModelOptions, Tip
from axisight.cli.screen import is_output
from axisight.errors import InputError
from axisight.logs import MAPS, named_map_text
from axisight.logs.guessing import Proposal, guess_columns
from axisight.storage import check_targets, write_whole

columns_app = typer.Typer(no_args_is_help=True, add_completion=False)


@columns_app.callback()
def _columns() -> None:
    """List, show and guess column maps: where a log keeps its signals, in which unit."""


@columns_app.command("list")
def list_command() -> None:
    """List the maps that ship with the package, by what their first line says."""
    for name in MAPS:
        first = named_map_text(name).splitlines()[0].removeprefix("# ")
        say(f"{name}: {first}")


@columns_app.command("show")
def show_command(name: Annotated[str, typer.Argument(help="Name of a map, as listed.")]) -> None:
    """Print a map that ships with the package, to be used as it is or changed."""
    with errors():
        typer.echo(named_map_text(name), nl=False)


@columns_app.command("guess")
def guess_command(
    log: Annotated[
        Path,
        typer.Argument(
            help="Log in any format that is read: CSV, TSV, JSON, Parquet, MAT, HDF5, NPY, NPZ, ROS bag, MCAP."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Column map to write. Default: the screen.")
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="robot.toml, URDF, MJCF or a preset: gives number, names and kinds of axes.",
        ),
    ] = None,
    base: Base = None,
    tip: Tip = None,
    force: Force = False,
) -> None:
    """Propose a column map from names and numbers, with the reason of every choice beside it."""
    with errors():
        out = None if is_output(out) else out
        given = [log, *(Path(x) for x in (robot,) if x)]
        check_targets({"-o": out}, inputs=given, replaces={"-o": ()}, force=force)
        options = ModelOptions(base, tip)
        if robot is None and options.given():
            raise InputError(
                f"{', '.join(options.given())}: expected --robot MODEL beside it, got none"
            )
        found = guess_columns(log, None if robot is None else options.load(robot))
        if out is None:
            typer.echo(found.text, nl=False)
            return
        write_whole(out, found.text)
        links = [("base", base), *(("tip", link) for link in options.tips)]
        chain = [word for name, link in links if link for word in (f"--{name}", link)]
        _say_found(out, log, [] if robot is None else ["--robot", robot, *chain], found)


def _say_found(out: Path, log: Path, beside: list[str], found: Proposal) -> None:
    if found.named is None:
        say(f"{out}: a map of its own; look at the reasons in it before use")
    elif found.doubts:
        say(f"{out}: the names are those of {found.named}, with fewer axes")
    else:
        say(f"{out}: the names are those of {found.named}; --columns {found.named} does the same")
    for doubt in found.doubts:
        say(f"doubtful: {doubt}")
    for name, reason in found.unused.items():
        say(f"not used: {name}: {reason}")
    check = ["axisight", "check", str(log), "--columns", str(out)]
    command = shlex.join([*check, *beside])
    if found.missing is None:
        say(f"then: {command}")
    else:
        say(f"then: complete the map ({found.missing}), and run {command}")
