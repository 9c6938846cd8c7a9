"""The commands ``axisight check``, ``schema`` and ``effects``: what a log, a verdict, the library is."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from axisight.cli.common import OUT, Columns, MaxBytes, Untrusted, errors
from axisight.effects import effect_table
from axisight.gap import verdict_schema
from axisight.logs import check_log, render
from axisight.logs.untrusted import check_log_inside


def check_command(
    log: Annotated[Path, typer.Argument(help="Log to check.")],
    columns: Columns = None,
    untrusted: Untrusted = False,
    max_bytes: MaxBytes = None,
) -> None:
    """Report rate, gaps, NaN, saturation, quantization, suspicious units and constant channels."""
    with errors():
        if untrusted:
            check_log_inside(log)
        found = check_log(log, columns, max_bytes=max_bytes)
        OUT.print(render(found))
        if not found.ok:
            raise typer.Exit(1)


def schema_command() -> None:
    """Print the JSON Schema of the verdict that `diagnose --json` writes."""
    typer.echo(dumps(verdict_schema(), indent=2))


def effects_command() -> None:
    """List the effects that can be simulated, fitted and named as causes."""
    table = Table("effect", "acts on", "equation", "parameters")
    for info in effect_table().values():
        parameters = ", ".join(f"{p.name} [{p.unit}]" for p in info.parameters)
        table.add_row(info.name, info.acts, info.equation, parameters)
    OUT.print(table)
