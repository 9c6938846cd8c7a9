"""The command ``axisight randomize``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from axisight.arguments import one_of
from axisight.cli.common import Force, errors, say
from axisight.cli.screen import OUT
from axisight.documents import parse_json, read_text
from axisight.errors import InputError
from axisight.posterior import (
    PROJECTS,
    Posterior,
    Randomization,
    load_posterior,
    plot_corner,
    randomization,
    randomization_document,
    save_randomization,
    with_repeats,
)
from axisight.storage import check_targets

_DOCUMENTS = (".yaml", ".yml", ".json")
_REPLACED = {"--out": (".py", *_DOCUMENTS), "--plot": (".png", ".pdf", ".svg")}


def randomize_command(
    posterior: Annotated[
        Path, typer.Argument(help="Posterior that 'axisight diagnose --posterior' wrote (.nc).")
    ],
    project: Annotated[
        str | None,
        typer.Option("--for", metavar="NAME", help=f"Project: {', '.join(PROJECTS)}."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="File to write: Python with --for; else ranges and joint draws for any simulator, .yaml or .json.",
        ),
    ] = None,
    elastic_gears: Annotated[
        bool,
        typer.Option(
            "--elastic-gears",
            help="The model has two joints for each axis with an elastic gear, as axisight.to_mujoco writes it.",
        ),
    ] = False,
    repeats: Annotated[
        Path | None,
        typer.Option(
            metavar="JSON",
            help="Document of 'axisight repeat --json': what varies between runs and days comes from it.",
        ),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Corner plot to write: .png, .pdf or .svg.")
    ] = None,
    force: Force = False,
) -> None:
    """Turn the posterior of a diagnosis into ranges and joint draws for training.

    Without --for: which parameters are known how well, which are correlated, which really vary between runs. With
    --out, a document for any simulator.
    """
    with errors():
        if out is not None:
            _check_ending(out, project)
        if project is not None:
            one_of("--for", project, PROJECTS)
        read = [posterior] if repeats is None else [posterior, repeats]
        check_targets({"--out": out, "--plot": plot}, inputs=read, replaces=_REPLACED, force=force)
        found = load_posterior(posterior)
        if repeats is not None:
            found = with_repeats(found, _document(repeats))
        if project is None:
            _show(found)
            if out is not None:
                made_for_any = randomization_document(found, elastic_gears=elastic_gears)
                say(f"written: {save_randomization(made_for_any, out)}")
        else:
            made = randomization(found, project, elastic_gears=elastic_gears)
            _show_ranges(made)
            if out is not None:
                say(f"written: {made.save(out)}")
        if plot is not None:
            plot_corner(found).savefig(plot, dpi=150)
            say(f"plot: {plot}")


def _document(path: Path) -> dict[str, Any]:
    """Return the document of a comparison of days."""
    try:
        content = parse_json(read_text(path))
    except (OSError, ValueError) as error:
        raise InputError(
            f"--repeats: expected the JSON of 'axisight repeat --json': {error}"
        ) from None
    if not isinstance(content, dict):
        raise InputError(f"--repeats: expected the JSON of 'axisight repeat --json', got {path}")
    return content


def _check_ending(out: Path, project: str | None) -> None:
    """Raise InputError for a file whose name says something else than its content will be."""
    document = out.suffix in _DOCUMENTS
    if project is None and not document:
        raise InputError(
            f"--out: expected a name ending in {', '.join(_DOCUMENTS)}, or --for beside it, one of "
            f"{', '.join(PROJECTS)}, got {out}"
        )
    if project is not None and document:
        raise InputError(
            f"--out: expected a Python file with --for, got {out}; without --for it is for any simulator"
        )


def _show(found: Posterior) -> None:
    """Print the parameters, their correlations and the open rivals."""
    known = found.gaussian()
    table = Table("parameter", "value", "95 % interval", "unit", "varies between runs")
    rows = zip(*(known[k].values.tolist() for k in ("value", "low", "high", "varies")), strict=True)
    for name, (value, low, high, varies) in zip(found.best.names, rows, strict=True):
        unit = found.parameter(name).unit
        interval = f"{low:.4g} to {high:.4g}"
        table.add_row(name, f"{value:.4g}", interval, "" if unit == "1" else unit, varies)
    OUT.print(table)
    for one, other, correlation in found.correlated():
        say(f"correlated: {one} and {other} ({correlation:+.2f})")
    for rival in found.hypotheses[1:]:
        say(f"open: {' + '.join(rival.causes)}, weight {rival.weight:.2f}")
    for label, why in found.without_values.items():
        say(f"open, without values here: {label}: {why}")


def _show_ranges(made: Randomization) -> None:
    """Print the ranges of a project, and what it has no number for."""
    table = Table("number", "range (95 %)", "unit", "varies between runs", "drawn")
    for f in made.fields:
        drawn = "together" if f.together else "alone"
        unit = "times" if f.unit == "1" else f.unit
        table.add_row(f.label, f"{f.low:.4g} to {f.high:.4g}", unit, f.varies, drawn)
    OUT.print(table)
    for name, why in made.without_home.items():
        say(f"no home: {name}: {why}")
