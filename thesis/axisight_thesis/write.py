"""Items on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from axisight_thesis.claims_file import read_claims, record_claims
from axisight_thesis.context import Context
from axisight_thesis.item import Item, item_names, registered

Progress = Callable[[str, int, int], None]


def run(
    name: str,
    context: Context,
    out: Path | None = None,
    progress: Progress = lambda name, done, total: None,
) -> list[Item]:
    """Return the computed items that ``name`` selects, in order, and write them to ``out`` if given.

    ``progress`` is called before each item with its name, the number of finished items and the total.
    ``claims.md`` in ``out`` also keeps the claims of items of earlier runs, and names the items that
    it lacks. Raises InputError, before any computation, for an unknown name and for a damaged record
    of earlier claims.
    """
    names = item_names(name)
    items = registered()
    if out is not None:
        read_claims(out)
    done = []
    for k, one in enumerate(names):
        progress(one, k, len(names))
        made = items[one](context)
        if out is not None:
            write_item(made, out, quick=context.quick)
            record_claims([made], context, out, list(items))
        done.append(made)
    progress("done", len(names), len(names))
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


def _stem(made: Item, suffix: str) -> str:
    return f"{made.name}-{suffix}" if suffix else made.name
