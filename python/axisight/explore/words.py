"""Tables and texts of the page as HTML; this module escapes everything that comes from files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

from axisight.effects import Effect, title
from axisight.explore.said import Said, SaidCause
from axisight.report.wording import number, percent, place, probability, unbroken

_UNKNOWN = "–"


def name_of(effect: Effect) -> str:
    """Return an effect and its place in words from the table of effects."""
    return f"{title(effect.name)}, {place(effect.axis, effect.axes)}"


def share(value: float | None) -> str:
    """Return a gap as a percentage."""
    return _UNKNOWN if value is None or math.isnan(value) else percent(value)


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    name: str,
    caption: str,
    *,
    unseen: bool = False,
) -> str:
    """Return an HTML table with row names in the first column; every cell is escaped.

    ``name``: its id. ``unseen``: whether only screen readers get the caption, because a heading says the
    same.
    """
    top = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    body = "".join(
        f'<tr><th scope="row">{escape(first)}</th>'
        + "".join(f"<td>{escape(unbroken(cell))}</td>" for cell in rest)
        + "</tr>"
        for first, *rest in rows
    )
    kind = ' class="unseen"' if unseen else ""
    return (
        f'<table id="{escape(name)}" class="ax"><caption{kind}>{escape(caption)}</caption>'
        f"<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
    )


def text(words: str, kind: str = "") -> str:
    """Return a paragraph; the words are escaped."""
    return f'<p class="ax {escape(kind)}">{escape(unbroken(words))}</p>'


def heading(words: str, level: int = 2) -> str:
    """Return a heading; the words are escaped."""
    return f'<h{level} class="ax">{escape(words)}</h{level}>'


TIME = "Measured and simulated torque, their difference, and the motor position."
AGAINST = (
    "What the difference depends on. Dots are samples as chosen, lines are means. A step at speed zero is friction; "
    "a line through zero is a wrong factor."
)
ORDERS = (
    "What repeats with the motor angle: amplitude of the difference by waves per turn of the motor."
)
BANDS = "Gap of the chosen log by frequency. The squares of the bands of an axis add up to that of its gap."
RESPONSE = (
    "Linear response from the torque of the chosen motor to the angles of all motors. Gains below 1e-12 of the "
    "largest are not drawn: no sensor resolves them, and many are rounding."
)
GAP = "The gap is the rms difference in per cent of the standard deviation of the measured"


def of_cause(cause: SaidCause) -> str:
    """Return a named cause with its values and their 95 % intervals."""
    said = [] if cause.probability is None else [f"probability {probability(cause.probability)}"]
    for name, value in (cause.effect.parameters or {}).items():
        low, high = cause.intervals.get(name, (None, None))
        span = "" if low is None or high is None else f" ({number(low)} to {number(high)})"
        said.append(f"{name} {number(value)}{span}")
    return f'<p class="ax"><b>{escape(name_of(cause.effect))}</b><br>{escape("; ".join(said))}</p>'


def of_verdict(said: Said, labels: Sequence[str]) -> str:
    """Return verdict, headline and gaps of a diagnosis; ``labels``: names of its axes."""
    rows = [
        (label, *map(share, row))
        for label, *row in zip(labels, said.before, said.after, said.floor, strict=True)
    ]
    head = ("axis", "before", "after", "floor")
    gaps = table(head, rows, "said-gaps", "Gap on the validation logs, as the diagnosis found it")
    return text(f"{said.verdict}: {said.headline}", "said") + gaps


STYLE = """
.ax { font: 14px/1.4 system-ui, sans-serif; color: #222; margin: 0 0 6px; }
h1.ax { font-size: 20px; font-weight: 650; margin: 4px 0; overflow-wrap: anywhere; }
h2.ax { font-size: 15px; font-weight: 600; margin: 8px 0 4px; overflow-wrap: anywhere; }
p.ax { overflow-wrap: anywhere; max-width: 90ch; }
table.ax { border-collapse: collapse; width: 100%; max-width: 640px; margin-bottom: 10px;
  font-variant-numeric: tabular-nums; }
table.ax th, table.ax td { text-align: right; padding: 2px 6px; border-bottom: 1px solid #ddd; }
table.ax th:first-child { text-align: left; }
table.ax thead th { font-weight: 600; color: #555; font-size: 13px; }
table.ax tbody th { font-weight: 400; }
table.ax td { white-space: nowrap; }
table.ax caption { text-align: left; color: #555; font-size: 13px; padding-bottom: 2px; }
table.ax caption.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
p.problem { color: #a33; } p.quiet { color: #595959; font-size: 13px; }
"""
