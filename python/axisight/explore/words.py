"""Tables and texts of the page as HTML; whatever comes from files is escaped here."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

from axisight.effects import Effect, title
from axisight.explore.said import Said, SaidCause
from axisight.report.wording import number, percent, place, probability

_UNKNOWN = "–"


def name_of(effect: Effect) -> str:
    """Return an effect and its place in words; both come from the table of effects."""
    return f"{title(effect.name)}, {place(effect.axis, effect.axes)}"


def share(value: float | None) -> str:
    """Return a gap in per cent."""
    return _UNKNOWN if value is None or math.isnan(value) else percent(value)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], name: str) -> str:
    """Return an HTML table; every cell is escaped. ``name``: its id."""
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f'<table id="{escape(name)}" class="ax"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>'


def text(words: str, kind: str = "") -> str:
    """Return a paragraph; the words are escaped."""
    return f'<p class="ax {escape(kind)}">{escape(words)}</p>'


def heading(words: str) -> str:
    """Return a heading; the words are escaped."""
    return f'<h3 class="ax">{escape(words)}</h3>'


def of_cause(cause: SaidCause) -> str:
    """Return a cause that a diagnosis named, with its values and their 95 % intervals."""
    said = [] if cause.probability is None else [f"probability {probability(cause.probability)}"]
    for name, value in (cause.effect.parameters or {}).items():
        low, high = cause.intervals.get(name, (None, None))
        span = "" if low is None or high is None else f" ({number(low)} to {number(high)})"
        said.append(f"{name} {number(value)}{span}")
    return f'<p class="ax"><b>{escape(name_of(cause.effect))}</b><br>{escape("; ".join(said))}</p>'


def of_verdict(said: Said) -> str:
    """Return verdict, headline and gaps of a diagnosis."""
    rows = [
        (str(i), share(b), share(a), share(f))
        for i, (b, a, f) in enumerate(zip(said.before, said.after, said.floor, strict=True), 1)
    ]
    gaps = table(("axis", "before", "after", "noise"), rows, "said-gaps")
    return text(f"{said.verdict}: {said.headline}", "said") + gaps


STYLE = """
.ax { font: 14px/1.4 system-ui, sans-serif; color: #222; margin: 0 0 6px; }
h3.ax { font-size: 15px; font-weight: 600; margin: 4px 0; }
table.ax { border-collapse: collapse; width: 100%; max-width: 640px; margin-bottom: 10px;
  font-variant-numeric: tabular-nums; }
table.ax th, table.ax td { text-align: right; padding: 2px 6px; border-bottom: 1px solid #ddd; }
table.ax th:first-child, table.ax td:first-child { text-align: left; }
table.ax th { font-weight: 600; color: #555; font-size: 13px; }
p.problem { color: #a33; } p.quiet { color: #666; font-size: 13px; }
"""
