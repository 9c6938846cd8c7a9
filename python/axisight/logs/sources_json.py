"""Read JSON and JSON lines: records, columns, or objects and lists of them, as named arrays."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import short, shown
from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader, given, refusing

# Wider tables are matrices of something else.
_MOST_COLUMNS = 10_000
_SHOWN = 8


def load_json(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every column of a JSON file, by name.

    A list of objects holds records, an object of lists holds columns. Members of inner objects have dotted
    names (`run.q`), and a list per sample becomes `q[0]`, `q[1]`, ... A column is refused if a record lacks it
    or if its lists are not all as long. Raises LogError for a key that stands twice in one object, for too
    many columns, and for a file that declares too much.
    """
    data = _declared(path, budget)
    return _whole(json.loads(data, object_pairs_hook=_object))


def load_json_lines(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every column of a file with one record a line; rules are those of `load_json`.

    Raises LogError, with the number of the line, for a line that is no JSON.
    """
    records = []
    for number, line in enumerate(io.BytesIO(_declared(path, budget)), start=1):
        if not line.strip():
            continue
        try:
            records.append(json.loads(line, object_pairs_hook=_object))
        except ValueError as error:
            raise LogError(
                f"line {number}: expected one JSON value, got a line that is truncated, corrupt or of "
                f"another format ({short(str(error), 200)})"
            ) from error
    if not records:
        raise ValueError("no line holds a record")
    return _whole(records)


def _declared(path: Path, budget: Budget) -> bytes:
    """Return the bytes of a file, after they and its values are counted against the budget.

    An object or list of k members has k - 1 commas.
    """
    budget.take(path.stat().st_size)
    data = path.read_bytes()
    budget.take_values((sum(map(data.count, (b",", b"[", b"{"))) + 1,), 8)
    return data


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise LogError(f"expected every key once, got {shown(twice)} several times")
    return made


def _whole(value: Any) -> dict[str, Reader]:
    if not isinstance(value, dict | list) or not value:
        empty = "an empty list" if value == [] else "an empty object" if value == {} else None
        raise LogError(f"expected records or columns, got {empty or shown(value)}")
    return _columns("", value)


def _columns(name: str, value: Any) -> dict[str, Reader]:
    """Return the columns of a value that is called ``name``."""
    if isinstance(value, dict):
        rows = _rows(value)
        return _members(name, value) if rows is None else _columns(name, rows)
    if not isinstance(value, list):
        return {name: given(_array([value])[0])}
    if value and all(isinstance(entry, dict) for entry in value):
        return _records(name, value)
    if value and all(isinstance(entry, list) for entry in value):
        return _entries(name, value)
    return {name or "0": given(_array(value))}


def _rows(value: dict[str, Any]) -> list[Any] | None:
    """Return the values of an object whose keys count its rows, as pandas writes them; None for another."""
    counted = value and all(key == str(row) for row, key in enumerate(value))
    return list(value.values()) if counted else None


def _members(name: str, value: dict[str, Any]) -> dict[str, Reader]:
    """Return the columns of the members of an object."""
    found: dict[str, Reader] = {}
    for key, inner in value.items():
        _add(found, _columns(f"{name}.{key}" if name else key, inner))
    return found


def _add(found: dict[str, Reader], more: dict[str, Reader]) -> None:
    """Add columns; of a name that is there already, none can be read."""
    for column, reader in more.items():
        twice = column in found
        found[column] = (
            refusing("expected one column of that name, got several") if twice else reader
        )
    _check_width(len(found))


def _records(name: str, records: Sequence[dict[str, Any]]) -> dict[str, Reader]:
    """Return the columns of records; one that a record lacks is refused."""
    columns: dict[str, list[Any]] = {}
    for record in records:
        for key, value in record.items():
            columns.setdefault(key, []).append(value)
    _check_width(len(columns))
    found: dict[str, Reader] = {}
    n = len(records)
    for key, values in columns.items():
        column = f"{name}.{key}" if name else key
        if len(values) == n:
            _add(found, _columns(column, values))
        else:
            said = f"expected it in every record, got none in {n - len(values)} of {n}"
            _add(found, {column: refusing(said)})
    return found


def _entries(name: str, lists: Sequence[list[Any]]) -> dict[str, Reader]:
    """Return the columns of lists, one list per sample."""
    lengths = sorted({len(entry) for entry in lists})
    if len(lengths) > 1:
        said = f"expected lists that are all as long, got lengths {lengths[:_SHOWN]}"
        return {name or "0": refusing(said)}
    _check_width(lengths[0])
    found: dict[str, Reader] = {}
    for k in range(lengths[0]):
        _add(found, _columns(f"{name}[{k}]" if name else str(k), [entry[k] for entry in lists]))
    return found


def _check_width(columns: int) -> None:
    if columns > _MOST_COLUMNS:
        raise LogError(f"expected at most {_MOST_COLUMNS} columns, got {columns}")


def _array(values: list[Any]) -> NDArray[Any]:
    """Return numbers as float64, and anything else as objects; None stands for a missing number."""
    if {type(value) for value in values} <= {int, float, bool, type(None)}:
        try:
            return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
        except OverflowError:  # whole numbers beyond float64
            pass
    return np.fromiter(values, dtype=object, count=len(values))
