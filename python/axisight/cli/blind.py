"""The commands ``axisight blind make``, ``run``, ``score`` and ``compare``."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from functools import partial
from importlib import import_module
from json import dumps
from pathlib import Path
from typing import Annotated, Any

import typer

from axisight.arguments import counted
from axisight.blind import comparison, comparison_table, judged_cases, markdown, summary
from axisight.blind.page import render_score
from axisight.cli.common import Force, bars, complain, errors, say, write_each, write_text
from axisight.cli.screen import OUT, is_output
from axisight.errors import InputError
from axisight.fleet import diagnose_fleet
from axisight.gap import Settings
from axisight.storage import check_folder, check_targets, write_bytes

blind_app = typer.Typer(
    add_completion=False,
    help="The withheld-effect benchmark: cases of other engines, diagnoses, a score.",
    no_args_is_help=True,
)

_Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes on this machine. Default: all cores.")
]


@blind_app.command("make")
def make_command(
    cases: Annotated[Path, typer.Argument(help="Folder for the cases.")],
    truth: Annotated[Path, typer.Option(help="Folder for the truths, apart from the cases.")],
    count: Annotated[int, typer.Option(min=1, help="Number of cases.")] = 24,
    first: Annotated[int, typer.Option(min=0, help="Number of the first case.")] = 0,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed; a case follows from seed and number.")
    ] = 0,
    workers: _Workers = None,
    engine: Annotated[
        str | None, typer.Option(help="mujoco or pinocchio. Default: drawn at random.")
    ] = None,
    arm: Annotated[
        str | None, typer.Option(help="One of the arms. Default: drawn at random.")
    ] = None,
    motions: Annotated[
        str | None, typer.Option(help="One of the motion plans. Default: drawn at random.")
    ] = None,
    effect: Annotated[
        str | None,
        typer.Option(help="Effect to withhold alone in every case. Default: drawn at random."),
    ] = None,
) -> None:
    """Simulate machines that differ from their simulator, with other engines (extra `blind`)."""
    with errors(), bars() as progress:
        check_folder(cases)
        check_folder(truth)
        # Imported here, because only this command needs the engines.
        from axisight.blind.drawing import Choice  # noqa: PLC0415
        from axisight.blind.make import make_cases  # noqa: PLC0415

        numbers = range(first, first + count)
        choice = Choice(engine, arm, motions, effect)
        make_cases(cases, truth, numbers, seed, workers or os.cpu_count() or 1, progress, choice)
    say(f"{counted(count, 'case')}: {cases}; what is withheld: {truth}")


@blind_app.command("run")
def run_command(
    cases: Annotated[Path, typer.Argument(help="Folder of cases.")],
    out: Annotated[Path, typer.Option(help="Folder for the verdicts; existing ones stay.")],
    workers: _Workers = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler whose workers diagnose the cases.")
    ] = None,
) -> None:
    """Diagnose every case of a folder that has no verdict yet."""
    with errors("stopped; finished verdicts stay, run again to go on"), bars() as progress:
        check_folder(out)
        found = diagnose_fleet(
            cases,
            out,
            Settings(),
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            progress=progress,
        )
    failed = {name: verdict["error"] for name, verdict in found.items() if "error" in verdict}
    for name, reason in failed.items():
        complain(f"{name}: {reason}")
    say(f"verdicts: {out}")
    if failed:
        raise typer.Exit(1)


@blind_app.command("score")
def score_command(
    cases: Annotated[Path, typer.Argument(help="Folder of cases.")],
    truth: Annotated[Path, typer.Option(help="Folder of the truths.")],
    verdicts: Annotated[Path, typer.Option(help="Folder of verdicts.")],
    out: Annotated[Path | None, typer.Option(help="Write the table here (Markdown).")] = None,
    json: Annotated[
        Path | None, typer.Option(help="Write the score here as JSON; - is standard output.")
    ] = None,
    html: Annotated[Path | None, typer.Option(help="Write the score here as a page.")] = None,
    plots: Annotated[
        Path | None, typer.Option(help="Write confusion.svg and calibration.svg into this folder.")
    ] = None,
    force: Force = False,
) -> None:
    """Open the truths: how often a cause was named, missed or invented, and how sure it was."""
    with errors():
        results = {"--out": (".md",), "--json": (".json",), "--html": (".html", ".htm")}
        piped = is_output(json)
        if piped:
            OUT.leave_output()
        targets = {"--out": out, "--json": None if piped else json, "--html": html}
        drawn = {} if plots is None else {name: plots / f"{name}.svg" for name in _PLOTS}
        targets |= {f"--plots ({name})": path for name, path in drawn.items()}
        results |= {f"--plots ({name})": (".svg",) for name in drawn}
        check_targets(targets, replaces=results, force=force)
        judged = judged_cases(cases, truth, verdicts)
        score = summary(judged)
        text = markdown(score)
        say(text)
        files = {out: text, json: dumps(score, indent=1) + "\n"}
        if html is not None:
            files[html] = render_score(cases.resolve().name, score)
        writes: list[Callable[[], object]] = [
            partial(write_text, path, made) for path, made in files.items() if path
        ]
        writes += [partial(_draw, name, score, path) for name, path in drawn.items()]
        write_each(writes)


@blind_app.command("compare")
def compare_command(
    cases: Annotated[Path, typer.Argument(help="Folder of cases; all of them count.")],
    truth: Annotated[Path, typer.Option(help="Folder of the truths.")],
    entries: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=ENTRIES",
            help="A method and its entries or verdicts: a folder with one JSON per case, or a file of lines"
            " (.jsonl). Repeatable.",
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Write the table here (Markdown).")] = None,
    json: Annotated[
        Path | None, typer.Option(help="Write the comparison here as JSON; - is standard output.")
    ] = None,
    force: Force = False,
) -> None:
    """Open the truths: the scores of several methods on the same cases; a missing entry is wrong."""
    with errors():
        if is_output(json):
            OUT.leave_output()
        targets = {"--out": out, "--json": None if is_output(json) else json}
        check_targets(targets, replaces={"--out": (".md",), "--json": (".json",)}, force=force)
        found = comparison(cases, truth, _methods(entries))
        text = comparison_table(found)
        say(text)
        files = {out: text, json: dumps(found, indent=1) + "\n"}
        write_each([partial(write_text, path, made) for path, made in files.items() if path])


def _methods(given: list[str]) -> dict[str, Path]:
    """Return folder or file of ``--entries`` by method; raise InputError for other text and for a repeated name."""
    found: dict[str, Path] = {}
    for text in given:
        name, equals, path = text.partition("=")
        if not (name and equals and path):
            raise InputError(f"--entries: expected NAME=ENTRIES, got {text!r}")
        if name in found:
            raise InputError(f"--entries: expected {name!r} once, got it twice")
        found[name] = Path(path)
    return found


# File name of a figure -> function of `axisight.blind.plots` that draws it.
_PLOTS = {"confusion": "plot_confusion", "calibration": "plot_calibration"}


def _draw(name: str, score: dict[str, Any], path: Path) -> None:
    """Write a figure of a score as SVG."""
    figure = getattr(import_module("axisight.blind.plots"), _PLOTS[name])(score)
    drawn = io.BytesIO()
    figure.savefig(drawn, format="svg", metadata={"Date": None})
    write_bytes(path, drawn.getvalue())
