"""A fleet as one self-contained page: the browser sorts and filters it without a network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from axisight.fleet.trends import Trend
from axisight.report.template import rendered
from axisight.report.wording import NO_VALUE, number, percent, place, plain_name, probability

_HEADS = (
    ("case", False),
    ("verdict", False),
    ("cause", False),
    ("probability", True),
    ("value", True),
    ("gap before", True),
    ("after", True),
    ("noise alone", True),
)
_WIDTH, _HEIGHT, _EDGE = 140.0, 30.0, 3.0


def render_fleet(name: str, table: pd.DataFrame, series: Sequence[Trend]) -> str:
    """Return a fleet's table and its changing causes as one HTML page.

    The same table gives the same text. All names and sentences are escaped.
    """
    growing = [_trend(t, name) for t in series if t.changes]
    page = {
        "name": name,
        "headline": _headline(table, len(growing)),
        "growing": growing,
        "n_series": len(series),
        "verdicts": sorted(set(table["verdict"])),
        "heads": [{"title": title, "num": num} for title, num in _HEADS],
        "rows": [_row(row) for row in table.to_dict("records")],
    }
    return rendered("fleet.html.j2", page, styles=("fleet.css",), script="fleet.js")


def _headline(table: pd.DataFrame, growing: int) -> str:
    by_case = table.drop_duplicates("case")
    count = by_case["verdict"].value_counts().sort_index()
    parts = ", ".join(f"{n} {verdict}" for verdict, n in count.items())
    machines = by_case["machine"].nunique()
    text = f"{_counted(len(by_case), 'case')} of {_counted(machines, 'machine')}: {parts}"
    return f"{text}; {_counted(growing, 'cause')} changing over time" if growing else text


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _cause(effect: str, axis: int | None) -> str:
    return f"{plain_name(effect)}, {place(axis)}"


def _row(row: dict[Any, Any]) -> dict[str, Any]:
    known: dict[str, Any] = {k: None if pd.isna(v) else v for k, v in row.items()}
    gaps = {k: known[f"gap_{k}"] for k in ("before", "after", "floor")}
    value = known["value"]
    cause = NO_VALUE
    if known["effect"] is not None:
        axis = known["axis"]
        cause = _cause(known["effect"], None if axis is None else int(axis))
    elif known["verdict"] == "error":
        cause = known["headline"]
    sure = known["probability"]
    return {
        "case": known["case"],
        "verdict": known["verdict"],
        "cause": cause,
        "probability": NO_VALUE if sure is None else probability(sure),
        "value": NO_VALUE if value is None else _measured(value, known["unit"]),
        **{k: NO_VALUE if v is None else percent(v) for k, v in gaps.items()},
        "order": {
            "probability": _key(sure),
            "value": _key(value),
            **{k: _key(v) for k, v in gaps.items()},
        },
    }


def _key(value: float | None) -> str:
    """Return the sort key of a cell."""
    return "" if value is None else repr(float(value))


def _measured(value: float, unit: str) -> str:
    return number(value) if unit == "1" else f"{number(value)} {unit}"


def _trend(trend: Trend, fleet: str) -> dict[str, str]:
    return {
        "machine": trend.machine or fleet,
        "cause": _cause(trend.effect, trend.axis),
        "points": _points(trend),
        "sizes": ", ".join(number(x) for x in trend.sizes),
        "slope": number(trend.per_case),
        "interval": f"{number(trend.low)} to {number(trend.high)}",
        "unit": trend.unit,
    }


def _points(trend: Trend) -> str:
    """Return the polyline of sizes, with zero as its base, in pixels."""
    top = max(float(trend.sizes.max()), 1e-300)
    step = (_WIDTH - 2 * _EDGE) / (len(trend.sizes) - 1)
    low = _HEIGHT - _EDGE
    return " ".join(
        f"{_EDGE + i * step:.1f},{low - (low - _EDGE) * size / top:.1f}"
        for i, size in enumerate(trend.sizes)
    )
