"""The command ``axisight reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from axisight.arguments import counted
from axisight.cli.common import errors, say
from axisight.cli.screen import BARS, OUT
from axisight.errors import InputError
from axisight.storage import check_folder

if TYPE_CHECKING:
    from axisight_thesis import Claim

_MISSING = (
    "the package axisight_thesis, which holds the study, is not installed: run 'make setup' in a "
    "checkout, or pip install 'axisight[thesis]'"
)


def reproduce_command(
    name: Annotated[
        str, typer.Argument(help="all, one item (table-8.2), or a part of a name (figure-8).")
    ],
    out: Annotated[Path, typer.Option(help="Folder for tables, figures and claims.")] = Path(
        "reproduced"
    ),
    seed: Annotated[int, typer.Option(min=0, help="Seed of phases and noise.")] = 0,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads. Default: all cores.")] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Fewer realizations and figures as small PNG only, for a first look."
        ),
    ] = False,
) -> None:
    """Reproduce the tables and figures of Wernholt's thesis on the preset robot."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with errors(f"stopped; finished items are in {out}"):
        check_folder(out)
        try:
            from axisight_thesis import context, run  # noqa: PLC0415
        except ModuleNotFoundError as error:
            if error.name != "axisight_thesis":
                raise
            raise InputError(_MISSING) from None
        with Progress(*columns, console=BARS) as bar:
            task = bar.add_task(escape(name))

            def report(line: str) -> None:
                bar.console.print(line, markup=False, highlight=False, soft_wrap=True)

            def progress(item: str, done: int, total: int) -> None:
                bar.update(task, description=item, completed=done, total=total)

            setting = context(seed=seed, threads=threads or 0, quick=quick, report=report)
            items = run(name, setting, out, progress)
        _show([claim for item in items for claim in item.claims])
        say(f"{counted(len(items), 'item')}: {out}")


def _show(claims: list[Claim]) -> None:
    if not claims:
        return
    table = Table("section", "statement", "holds", "evidence")
    for c in claims:
        table.add_row(
            c.section, c.statement, "yes" if c.holds else f"[bold]{c.verdict}[/]", c.evidence
        )
    OUT.print(table)
