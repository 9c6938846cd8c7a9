"""Items and claims on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item, item_names, registered

Progress = Callable[[str, int, int], None]


def run(
    name: str,
    context: Context,
    out: Path | None = None,
    progress: Progress = lambda name, done, total: None,
) -> list[Item]:
    """Return the computed items that ``name`` selects, in order, and write them to ``out`` if given.

    ``progress`` is called before each item with its name, the number of finished items and the total.
    Raises InputError for an unknown name, before any computation.
    """
    names = item_names(name)
    items = registered()
    done = []
    for k, one in enumerate(names):
        progress(one, k, len(names))
        made = items[one](context)
        if out is not None:
            write_item(made, out, quick=context.quick)
        done.append(made)
    progress("done", len(names), len(names))
    claims = [claim for made in done for claim in made.claims]
    if out is not None and claims:
        write_claims(claims, out)
    return done


def write_item(made: Item, out: Path, *, quick: bool = False) -> list[Path]:
    """Write tables as CSV (full precision) and figures as PDF and PNG; return the paths.

    ``quick`` leaves out the PDF and halves the resolution of the PNG.
    """
    out.mkdir(parents=True, exist_ok=True)
    paths = []
    for suffix, table in made.tables.items():
        path = out / f"{_stem(made, suffix)}.csv"
        table.to_csv(path, index=False, lineterminator="\n")
        paths.append(path)
    for suffix, figure in made.figures.items():
        paths += _draw(figure, out / _stem(made, suffix), quick)
    return paths


def _draw(figure: Figure, path: Path, quick: bool) -> list[Path]:
    """Write a figure as PNG and PDF, and return the paths; both share the slow layout."""
    png, pdf = path.with_name(f"{path.name}.png"), path.with_name(f"{path.name}.pdf")
    figure.set_dpi(100 if quick else 200)
    if quick:  # twice as fast without a layout engine
        figure.set_layout_engine(None)
        width, height = figure.get_size_inches()
        edges = 0.65 / width, 0.5 / height, 1 - 0.1 / width, 1 - 0.55 / height
        figure.subplots_adjust(*edges, wspace=0.08, hspace=0.22)
    FigureCanvasAgg(figure).print_png(str(png))  # type: ignore[no-untyped-call]
    if quick:
        return [png]
    figure.set_layout_engine("none")
    # Without a creation date, the same study gives the same bytes.
    figure.savefig(pdf, metadata={"CreationDate": None})
    return [pdf, png]


def write_claims(claims: Iterable[Claim], out: Path) -> list[Path]:
    """Write ``claims.csv`` and ``claims.md``, ordered by section, and return the paths."""
    out.mkdir(parents=True, exist_ok=True)
    claims = sorted(claims, key=lambda c: c.section)
    columns = ["id", "section", "statement", "holds", "evidence"]
    rows = [[c.id, c.section, c.statement, c.verdict, c.evidence] for c in claims]
    table = out / "claims.csv"
    pd.DataFrame(rows, columns=columns).to_csv(table, index=False, lineterminator="\n")
    page = out / "claims.md"
    page.write_text(_page(claims), encoding="utf-8")
    return [table, page]


def _page(claims: list[Claim]) -> str:
    count = {v: sum(c.verdict == v for c in claims) for v in ("yes", "no", "undecided")}
    undecided = f", {count['undecided']} are undecided" if count["undecided"] else ""
    summary = f"{count['yes']} of {len(claims)} hold on this robot{undecided}."
    lines = ["# Claims", "", summary, ""]
    lines += ["| section | statement | holds | evidence |", "|---|---|---|---|"]
    for c in claims:
        cells = (c.section, c.statement, "yes" if c.holds else f"**{c.verdict}**", c.evidence)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _stem(made: Item, suffix: str) -> str:
    return f"{made.name}-{suffix}" if suffix else made.name
