"""The command ``axisight montecarlo``."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.progress import Progress as Bars
from rich.table import Table

from axisight import montecarlo
from axisight.arguments import counted
from axisight.cli.common import errors, say
from axisight.cli.robot import GivenEffects, effects_on, parse_effects, say_effects
from axisight.cli.screen import BARS, OUT
from axisight.effects import Effect
from axisight.errors import StudyError
from axisight.montecarlo.backends import available_threads
from axisight.montecarlo.estimate import estimate
from axisight.montecarlo.progress import Progress, Report
from axisight.robot import load_robot

# More runs than this are more often a mistake than intended.
_UNASKED = 100_000


def montecarlo_command(
    study: Annotated[Path, typer.Argument(help="Study (TOML).")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")],
    runs: Annotated[
        int | None, typer.Option(help="Number of runs. Default: that of the study.")
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of every random choice. Default: that of the study."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the study that is in the folder, also to more runs."
        ),
    ] = False,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, e.g. tcp://10.0.0.1:8786.")
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(min=1, max=1024, help="Threads on this machine. Default: all cores."),
    ] = None,
    effect: GivenEffects = None,
    yes: Annotated[bool, typer.Option("--yes", help=f"Allow more than {_UNASKED} runs.")] = False,
) -> None:
    """Run a Monte Carlo study; the same study and seed give the same bits, however it is run."""
    with errors(f"stopped; finished blocks are in {out}, go on with --resume"):
        texts = parse_effects(effect)
        design = montecarlo.read_study(study)
        robot = load_robot(design.robot)
        design = _with_given(design, effects_on(robot, texts))
        given = [Effect(**entry.model_dump()) for entry in design.effect]
        say_effects(robot, design.robot, given)
        changes = {"runs": runs, "seed": seed}
        design = design.changed(**{k: v for k, v in changes.items() if v is not None})
        if design.runs > _UNASKED and not yes:
            takes = estimate(design, threads or available_threads())
            raise StudyError(f"runs: {takes}: pass --yes to run more than {_UNASKED}")
        with _bar() as progress:
            result = montecarlo.run(
                design,
                out=out,
                resume=resume,
                backend="local" if scheduler is None else "dask",
                scheduler=scheduler,
                threads=threads,
                progress=progress,
            )
        failed = montecarlo.failures(result)
        done = int(result["count"].max())
        if len(failed):
            table = Table("run", "seed", "experiment", "kind", "detail", title="failed runs")
            for row in failed.head(10).itertuples(index=False):
                table.add_row(*(escape(str(cell)) for cell in row))
            OUT.print(table)
        runs_failed = failed["run"].nunique()
        say(f"{counted(done, 'run')} counted, {runs_failed} with failures: {out}")
        if done == 0:
            raise typer.Exit(1)


def _with_given(design: montecarlo.Study, given: list[Effect]) -> montecarlo.Study:
    """Return the study with ``given`` effects in place of its own of the same name and axis."""
    replaced = {effect.label for effect in given}
    own = [e for e in design.effect if Effect(**e.model_dump()).label not in replaced]
    more = [
        montecarlo.EffectEntry(
            name=e.name, axis=e.axis, axes=e.axes, parameters=dict(e.parameters or {})
        )
        for e in given
    ]
    return design.model_copy(update={"effect": [*own, *more]})


@contextmanager
def _bar() -> Iterator[Report]:
    columns = (
        TextColumn("runs"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}"),
    )
    with Bars(*columns, console=BARS) as bars:
        task = bars.add_task("runs", total=None, pace="")

        def report(state: Progress) -> None:
            if state.message:
                bars.console.print(state.message, markup=False, highlight=False, soft_wrap=True)
            pace = f"{state.rate_hz:.3g} runs/s, {state.remaining_s:.0f} s left"
            if state.failed:
                pace += f", {state.failed} failed"
            shown = "" if math.isnan(state.rate_hz) else pace
            bars.update(task, completed=state.done, total=state.total, pace=shown)

        yield report
