"""The commands ``axisight schema`` and ``axisight effects``."""

from __future__ import annotations

from json import dumps

import typer
from rich.table import Table

from axisight.cli.screen import OUT
from axisight.effects import effect_table
from axisight.gap import verdict_schema


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
