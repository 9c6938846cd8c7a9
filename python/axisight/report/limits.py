"""Detection limits as a table: one row per effect, one column per axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from axisight.gap.facts.result import DetectionLimit
from axisight.report.wording import NO_VALUE, number, plain_name

# Words for a missing limit, by what hides the effect.
_HIDDEN = {"tolerances": "hidden", "motion": "never"}
_MEANING = {
    "hidden": "Hidden: the simulator's own parameters, or a plainer law, make up for any size.",
    "never": "Never: no size shows in this motion.",
}


@dataclass(frozen=True)
class LimitTable:
    """A table: ``columns`` are the axes, plus the arm if an effect acts on it; ``rows`` title, unit, values.

    ``note`` explains words among the values; it is empty without them.
    """

    columns: list[str]
    rows: list[list[str]]
    note: str


def limit_table(limits: Sequence[DetectionLimit], n_axes: int) -> LimitTable:
    """Return the limits as texts: ``hidden`` or ``never`` where no possible size would show."""
    places: list[int | None] = list(range(1, n_axes + 1))
    if any(limit.axis is None for limit in limits):
        places.append(None)
    lines: dict[str, dict[int | None, DetectionLimit]] = {}
    for limit in limits:
        lines.setdefault(limit.effect, {})[limit.axis] = limit
    rows = []
    for effect, mine in sorted(lines.items()):
        first = next(iter(mine.values()))
        unit = first.unit
        title = plain_name(effect) + ("" if first.axes is None else ", with the next axis")
        values = [_value(mine[p]) if p in mine else NO_VALUE for p in places]
        rows.append([title, "" if unit == "1" else unit, *values])
    words = {cell for row in rows for cell in row[2:]}
    note = " ".join(meaning for word, meaning in _MEANING.items() if word in words)
    return LimitTable(["arm" if p is None else f"axis {p}" for p in places], rows, note)


def _value(limit: DetectionLimit) -> str:
    if limit.value is not None:
        return number(limit.value, 2)
    assert limit.hidden is not None  # without a value something hides it
    return _HIDDEN[limit.hidden]
