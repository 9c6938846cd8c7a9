"""The command ``axisight mcp``."""

from __future__ import annotations

import warnings
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.assistants.words import skill
from axisight.cli.common import errors
from axisight.errors import InputError, MissingExtraError


def mcp_command(
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="FOLDER", help="The folder whose files the assistant may read."),
    ] = None,
    allow_write: Annotated[
        bool,
        typer.Option(
            "--allow-write",
            help="Also write maps, verdicts, reports, models and experiments into the folder, where a tool "
            "is asked to.",
        ),
    ] = False,
    skill_file: Annotated[
        bool,
        typer.Option(
            "--skill",
            help="Print a skill file, which tells an assistant how to use the command line, and end.",
        ),
    ] = False,
) -> None:
    """Serve check, columns, diagnosis and next experiment to an assistant, for the files of one folder.

    The server speaks the Model Context Protocol on standard input and output. An assistant starts it itself.
    """
    if skill_file:
        typer.echo(skill(), nl=False)
        return
    with errors(stopped="stopped"):
        if folder is None:
            raise InputError("FOLDER: expected the folder that the assistant may read, got nothing")
        if find_spec("mcp") is None:
            raise MissingExtraError("axisight mcp needs the MCP library: pip install axisight[mcp]")
        server = import_module("axisight.cli.assistants.server").make_server(
            folder, may_write=allow_write
        )
        # As in `errors`, which acts on this thread only: diagnoses run in others.
        warnings.simplefilter("ignore", RuntimeWarning)
        server.run("stdio")
