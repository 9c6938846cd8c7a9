"""HTML tables for notebooks, with all text escaped, and without scripts, styles or external resources."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice

_MOST_ROWS = 60
_LONGEST = 500


def page(title: str, *parts: str) -> str:
    """Return a heading, escaped, above parts that are HTML already."""
    return f"<div><p><strong>{_text(title)}</strong></p>{''.join(parts)}</div>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str) -> str:
    """Return a table of texts below its caption; after 60 rows, one row states the number of the others."""
    rows = iter(rows)
    shown = [_row("td", row) for row in islice(rows, _MOST_ROWS)]
    more = sum(1 for _ in rows)
    if more:
        shown.append(_row("td", (f"and {more} more", *[""] * (len(head) - 1))))
    if not shown:
        return ""
    above = f"<caption>{_text(caption)}</caption>"
    return f"<table>{above}<thead>{_row('th', head)}</thead><tbody>{''.join(shown)}</tbody></table>"


def values(
    names: Sequence[str],
    found: Iterable[float],
    std: Iterable[float],
    units: Sequence[str] | None = None,
) -> str:
    """Return a table of parameters with standard errors, and with units if they are given."""
    rows = zip(names, map(number, found), map(number, std), units or [""] * len(names), strict=True)
    head = ("parameter", "value", "standard error", *(["unit"] if units else []))
    return table(head, (row[: len(head)] for row in rows), "Parameters with standard errors")


def lines(texts: Iterable[str]) -> str:
    """Return one paragraph per text."""
    return "".join(f"<p>{_text(text)}</p>" for text in texts)


def number(value: float) -> str:
    """Return a number with four significant digits."""
    return f"{value:.4g}"


def _row(cell: str, texts: Sequence[str]) -> str:
    scope = ' scope="col"' if cell == "th" else ""
    return "<tr>" + "".join(f"<{cell}{scope}>{_text(text)}</{cell}>" for text in texts) + "</tr>"


def _text(text: str) -> str:
    cut = text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
    return escape(cut, quote=True)
