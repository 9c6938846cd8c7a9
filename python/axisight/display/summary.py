"""Short representations of results: a few lines in a terminal, a table in a notebook.

Numbers are shown with four digits and their units, arrays with their shape and range.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from itertools import islice
from pathlib import PurePath
from typing import Any, TypeVar

import numpy as np

from axisight.display import html

T = TypeVar("T", bound=type)

MOST = 7
"""Entries of a table, or of a list of results, that a repr shows."""
# Most lines of a result in a terminal, entries of an array shown one by one, and items of a list.
_MOST_LINES = 24
_MOST_NUMBERS = 6
_MOST_WORDS = 4
_LONGEST = 100
_INSIDE = 60
# Suffix of a field name -> unit; longer suffixes come first.
_UNITS = (
    ("kg_m2", "kg m^2"),
    ("nm_s_rad", "Nm s/rad"),
    ("nm_rad", "Nm/rad"),
    ("rad_nm", "rad/Nm"),
    ("rad_s2", "rad/s^2"),
    ("m_s2", "m/s^2"),
    ("rad_s", "rad/s"),
    ("nm_a", "Nm/A"),
    ("kg_m", "kg m"),
    ("m_s", "m/s"),
    ("nm", "Nm"),
    ("rad", "rad"),
    ("hz", "Hz"),
    ("kg", "kg"),
    ("db", "dB"),
    ("percent", "%"),
    ("s", "s"),
    ("m", "m"),
)
# Words after the unit at the end of a name, which do not change the unit.
_LONG = re.compile(r"_(?:std|rms|per_axis)$")


def summarized(kind: T) -> T:
    """Return the dataclass ``kind`` with a short repr and a table for notebooks, made from its fields.

    Fields with ``repr=False`` are left out. If the class has parameters (``names`` or ``free``, with
    ``values`` and ``std`` or ``standard_error``), these come first, with standard errors. A class keeps its
    own `_repr_html_` and ``__str__``. If it has a method ``_summary`` that returns a title and rows of
    (name, text), the repr shows these in place of the fields. A short repr takes one line.
    """
    kind.__repr__ = _text  # type: ignore[assignment]
    if "_repr_html_" not in kind.__dict__:
        kind._repr_html_ = _html  # type: ignore[attr-defined]
    return kind


def _text(self: object) -> str:
    """Return the repr: the fields in one line if they fit, else one line per field."""
    title, rows = type(self).__name__, None
    if (own := getattr(self, "_summary", None)) is not None:
        title, rows = own()
    elif _parameters(self) is None and (line := _line(self, _LONGEST)):
        return line
    rows = _rows(self) if rows is None else rows
    more = len(rows) - _MOST_LINES
    width = max((len(name) for name, _ in rows), default=0)
    lines = [f"  {name:<{width}}  {value}".rstrip() for name, value in rows[:_MOST_LINES]]
    lines += [f"  and {more} more"] if more > 0 else []
    return "\n".join([title, *lines])


def _line(thing: object, most: int) -> str:
    """Return the fields in one line of at most ``most`` characters; "" if they do not fit."""
    shown = ", ".join(f"{key}={shortened(value, key)}" for key, value in _fields(thing))
    line = f"{type(thing).__name__}({shown})"
    return line if len(line) <= most else ""


def _html(self: object) -> str:
    """Return the fields, and the parameters if there are any, as HTML tables."""
    name = type(self).__name__
    parameters = _parameters(self)
    left_out = set() if parameters is None else {"names", "free", "values", "std", "standard_error"}
    shown = [(key, shortened(value, key)) for key, value in _fields(self) if key not in left_out]
    parts = [html.table(("field", "value"), shown, f"What is known of this {name}")]
    if parameters is not None:
        parts.append(html.values(*parameters))
    return html.page(name, *parts)


def _rows(thing: object) -> list[tuple[str, str]]:
    """Return (name, text) rows: parameters with standard errors first, then the other fields."""
    parameters = _parameters(thing)
    if parameters is None:
        return [(key, shortened(value, key)) for key, value in _fields(thing)]
    names, values, errors = parameters
    found = [
        (name, f"{html.number(value)} +- {html.number(error)}")
        for name, value, error in zip(names, values, errors, strict=True)
    ]
    left_out = {"names", "free", "values", "std", "standard_error", "parameters"}
    rest = [(key, shortened(value, key)) for key, value in _fields(thing) if key not in left_out]
    most = max(4, _MOST_LINES - len(rest))
    if len(found) > most:
        found = [*found[: most - 1], ("...", f"and {len(found) - most + 1} parameters more")]
    return [*found, *rest]


def _fields(thing: object) -> list[tuple[str, Any]]:
    """Return the fields of a dataclass to show: those with repr that are neither None nor empty text."""
    if not is_dataclass(thing):
        return []
    shown = [(f.name, getattr(thing, f.name)) for f in fields(thing) if f.repr]
    return [(key, value) for key, value in shown if value is not None and not _is_empty_text(value)]


def _is_empty_text(value: object) -> bool:
    return isinstance(value, str) and not value


def _parameters(thing: object) -> tuple[Sequence[str], Sequence[float], Sequence[float]] | None:
    """Return names, values and standard errors of a result; None if it lacks them."""
    names = getattr(thing, "free", getattr(thing, "names", None))
    values = getattr(thing, "values", None)
    errors = getattr(thing, "standard_error", getattr(thing, "std", None))
    if not isinstance(names, Sequence) or isinstance(names, str):
        return None
    numbers = [x for x in (values, errors) if isinstance(x, np.ndarray) and x.ndim == 1]
    if len(numbers) != 2 or any(len(x) != len(names) for x in numbers) or not len(names):
        return None
    return [str(name) for name in names], numbers[0].tolist(), numbers[1].tolist()


def shortened(value: object, name: str = "") -> str:
    """Return a value in a few words, with the unit that the suffix of its ``name`` states."""
    text = _worded(value)
    unit = _unit(name) if _is_numeric(value) else ""
    return f"{text} {unit}".rstrip()


def _unit(name: str) -> str:
    name = _LONG.sub("", name.lower())
    for end, unit in _UNITS:
        if name == end or name.endswith(f"_{end}"):
            return unit
    return ""


def _is_numeric(value: object) -> bool:
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fc" and value.size > 0
    if isinstance(value, tuple | list):
        return bool(value) and all(_is_numeric(item) for item in value)
    return isinstance(value, float | np.floating)


def _worded(value: object) -> str:  # noqa: PLR0911 one line a kind
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, int | np.integer | float | np.floating | complex | np.complexfloating):
        return _number(value)
    if isinstance(value, str | PurePath):
        return _cut(str(value))
    if isinstance(value, np.ndarray):
        return _array(value)
    # Tables of xarray and pandas by their attributes, so that neither library must be imported.
    if isinstance(sizes := getattr(value, "sizes", None), Mapping):
        listed = ", ".join(f"{dim}: {size}" for dim, size in sizes.items())
        return f"{type(value).__name__} ({listed})"
    if isinstance(shape := getattr(value, "shape", None), tuple) and len(shape) == 2:
        return f"{type(value).__name__} ({shape[0]} rows, {shape[1]} columns)"
    if isinstance(value, Mapping):
        some = islice(value.items(), _MOST_WORDS)
        return _list([f"{key}: {_item(item)}" for key, item in some], len(value))
    if isinstance(value, tuple | list | set | frozenset):
        return _list([_item(item) for item in islice(value, _MOST_WORDS)], len(value))
    return _item(value)


def _item(value: object) -> str:
    """Return text for a value inside another one; for a result, its own words, its fields or its type."""
    if isinstance(value, str | PurePath | bool | int | float | complex | np.generic | np.ndarray):
        return _worded(value)
    if isinstance(value, tuple | list | Mapping):
        return f"({_worded(value)})" if value else "none"
    own = type(value).__dict__
    named = getattr(value, "label", None) or getattr(value, "name", None)
    if "__str__" in own and "\n" not in (said := str(value)):
        return _cut(said)
    kind = type(value).__name__
    if hasattr(type(value), "_repr_html_") and (line := _line(value, _INSIDE)):
        return line
    return f"{kind} {_cut(named)}" if isinstance(named, str) and named else kind


def _number(value: Any) -> str:
    if isinstance(value, complex | np.complexfloating):
        return f"{value:.4g}"
    return str(int(value)) if isinstance(value, int | np.integer) else html.number(float(value))


def _array(value: np.ndarray[Any, Any]) -> str:
    if value.size == 0:
        return "none"
    if value.ndim <= 1 and value.size <= _MOST_NUMBERS:
        numbers = value.reshape(-1).tolist()
        return ", ".join(_worded(x) for x in numbers)
    shape = " x ".join(map(str, value.shape))
    if value.dtype.kind not in "biufc":
        return f"{shape} values"
    size = np.abs(value) if value.dtype.kind == "c" else value
    finite = size[np.isfinite(size)]
    if not finite.size:
        return f"{shape} numbers, none finite"
    what = "of size " if value.dtype.kind == "c" else ""
    low, high = (_worded(x.item()) for x in (finite.min(), finite.max()))
    return f"{shape} numbers, {what}{low} to {high}"


def _list(first: Sequence[str], count: int) -> str:
    """Return the first texts joined by commas, and the number of the others."""
    more = f", and {count - len(first)} more" if count > len(first) else ""
    return _cut(", ".join(first)) + more if first else "none"


def _cut(text: str) -> str:
    flat = " ".join(text.split())
    return flat if len(flat) <= _LONGEST else f"{flat[: _LONGEST - 3]}..."
