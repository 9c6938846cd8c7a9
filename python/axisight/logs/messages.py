"""Convert the messages of recordings of any format to named series of numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import index
from typing import Any, SupportsIndex

import numpy as np

from axisight.arguments import short
from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader, given, refusing

# Fields with the joint names; the other arrays of the message are in their order.
_NAMES = ("name", "joint_names", "names")
# Arrays with one number per joint, or empty.
_OF_JOINTS = (
    *("position", "velocity", "effort", "acceleration"),
    *("positions", "velocities", "efforts", "accelerations"),
)
_JOINTS = "joints"
# Fields with the time of a message, which are not signals.
_STAMPS = ("header", "stamp", "timestamp")
_SECONDS, _NANOSECONDS = ("sec", "secs", "seconds"), ("nanosec", "nsec", "nsecs", "nanos")
_DEEPEST = 4
_MOST_UNNAMED = 64
# Bytes that a number takes in memory until all messages are read.
_NUMBER_COST = 64


class Topics:
    """The numbers in the messages of all topics, one series per topic and set of joints.

    Each message counts against ``budget`` when it is added.
    """

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._series: dict[tuple[str, frozenset[str]], _Series] = {}

    def add(self, topic: str, received_ns: int, message: Any, *, numbered: bool = False) -> None:
        """Add a message, a dataclass or a dictionary; its time is its stamp, else ``received_ns`` (ns).

        ``numbered``: entries of arrays without names are named by number from 0. A fault in a field is
        reported, with topic and time, only when that field is read. Raises LogError when the budget is spent.
        """
        names = _names(message)
        walk = _Walk(names, numbered=numbered and not names)
        row = dict(walk.numbers(message))
        self._budget.take(_NUMBER_COST * len(row))
        label = topic.strip("/").replace("/", ".")
        key = (label, frozenset([*names, *walk.found]))
        self._series.setdefault(key, _Series()).add(_stamp_ns(message, received_ns), row)

    def drop(self, topic: str) -> None:
        """Delete all series of a topic."""
        label = topic.strip("/").replace("/", ".")
        self._series = {key: one for key, one in self._series.items() if key[0] != label}

    def readers(self) -> dict[str, Reader]:
        """Return a reader for every column; a second series of a topic, for other joints, is ``topic#2``."""
        out: dict[str, Reader] = {}
        seen: dict[str, int] = {}
        for (topic, _), one in self._series.items():
            columns = one.columns(topic)
            if columns:
                seen[topic] = seen.get(topic, 0) + 1
                label = topic if seen[topic] == 1 else f"{topic}#{seen[topic]}"
                out |= {f"{label}.{name}": read for name, read in columns.items()}
        return out


def said_of(topic: str, time_ns: int) -> str:
    """Return the words by which errors call a message."""
    return f"topic {short(topic)}: message of {time_ns * 1e-9:.6f} s"


# A number, or the reason why there is none.
_Value = float | str


@dataclass
class _Series:
    """Messages of one topic about the same joints."""

    stamps_ns: list[int] = field(default_factory=list)
    rows: list[dict[str, _Value]] = field(default_factory=list)

    def add(self, stamp_ns: int, row: dict[str, _Value]) -> None:
        self.stamps_ns.append(stamp_ns)
        self.rows.append(row)

    def columns(self, topic: str) -> dict[str, Reader]:
        """Return a reader for every column that any message has, and for the time [s]; {} without columns."""
        names = dict.fromkeys(name for row in self.rows for name in row)
        if not names:
            return {}
        stamps = np.array(self.stamps_ns, dtype=np.int64)
        out = {"time_s": given((stamps - stamps[0]) * 1e-9)}
        for name in names:
            values = [
                row.get(name, "expected it as in other messages, got none") for row in self.rows
            ]
            bad = [k for k, value in enumerate(values) if isinstance(value, str)]
            if bad:
                few = f"{len(bad)} of {len(values)} messages are so"
                said = said_of(topic, self.stamps_ns[bad[0]])
                out[name] = refusing(f"{said}: {name}: {values[bad[0]]}; {few}")
            else:
                out[name] = given(np.array(values, dtype=np.float64))
        return out


def _names(message: Any) -> list[str]:
    for key in _NAMES:
        found = _fields(message).get(key)
        if isinstance(found, list | tuple) and all(isinstance(name, str) for name in found):
            return list(found)
    return []


def _fields(message: Any) -> Mapping[str, Any]:
    if isinstance(message, dict):
        return message
    keys = getattr(message, "__dataclass_fields__", {})
    return {key: getattr(message, key) for key in keys if not key.startswith("__")}


def _stamp_ns(message: Any, received_ns: int) -> int:
    """Return the time stamp in a message (ns), or when it was received if it has none."""
    fields = _fields(message)
    stamps = [_fields(fields.get("header")).get("stamp"), *map(fields.get, _STAMPS[1:])]
    for stamp in stamps:
        parts = _fields(stamp)
        seconds = next((parts[key] for key in _SECONDS if key in parts), None)
        rest = next((parts[key] for key in _NANOSECONDS if key in parts), 0)
        # Not `int`: integers of NumPy count too.
        if isinstance(seconds, SupportsIndex) and isinstance(rest, SupportsIndex):
            said = index(seconds) * 1_000_000_000 + index(rest)
            if 0 < said < 2**63:
                return said
    return received_ns


class _Walk:
    """A walk through the fields of a message; ``found`` collects the names of joints met on the way."""

    def __init__(self, names: Sequence[str], *, numbered: bool) -> None:
        self.names = names
        self.numbered = numbered
        self.found: list[str] = []

    def numbers(
        self, message: Any, prefix: str = "", depth: int = 0
    ) -> Iterator[tuple[str, _Value]]:
        """Yield every number of a message with its name, which ends in the joint for arrays over joints."""
        for key, value in _fields(message).items():
            if key in _NAMES or (key in _STAMPS[: 1 if depth else None] and _fields(value)):
                continue
            label = f"{prefix}{key}"
            if isinstance(value, bool | int | float | np.number):
                yield label, _number(value)
            elif isinstance(value, np.ndarray):
                if value.ndim == 1 and value.dtype.kind in "biuf":
                    yield from self._array(key, label, value.tolist())
            elif isinstance(value, list | tuple):
                if all(isinstance(one, bool | int | float) for one in value):
                    yield from self._array(key, label, value)
                elif depth < _DEEPEST:
                    # So joints of foxglove.JointStates get the same names as those of ROS.
                    place = "" if key == _JOINTS and not depth else f"{label}."
                    yield from self._objects(place, value, depth)
            elif _fields(value) and depth < _DEEPEST:
                yield from self._nested(value, f"{label}.", depth + 1)

    def _nested(self, value: Any, prefix: str, depth: int) -> Iterator[tuple[str, _Value]]:
        """Yield the numbers of an object; its own joint names, if any, replace those of the message."""
        names = _names(value)
        if not names:
            yield from self.numbers(value, prefix, depth)
            return
        self.found += names
        yield from _Walk(names, numbered=False).numbers(value, prefix, depth)

    def _array(self, key: str, label: str, values: Sequence[float]) -> Iterable[tuple[str, _Value]]:
        names = self.names
        if names and key in _OF_JOINTS and len(set(names)) < len(names):
            why = _doubled(names)
            return ((f"{label}.{name}", why) for name in dict.fromkeys(names))
        if len(values) == len(names):
            return ((f"{label}.{n}", _number(v)) for n, v in zip(names, values, strict=True))
        if names and values and key in _OF_JOINTS:
            why = f"expected as many numbers as names, {len(names)}, got {len(values)}"
            return ((f"{label}.{name}", why) for name in names)
        if self.numbered and len(values) <= _MOST_UNNAMED:
            return ((f"{label}.{k}", _number(value)) for k, value in enumerate(values))
        return ()

    def _objects(
        self, place: str, values: Sequence[Any], depth: int
    ) -> Iterator[tuple[str, _Value]]:
        """Yield the numbers of named objects as ``place.field.NAME``; nothing if one of them has no name."""
        names = [_fields(one).get("name") for one in values]
        if not all(isinstance(name, str) for name in names):
            return
        why = _doubled([str(name) for name in names]) if len(set(names)) < len(names) else None
        for one, name in zip(values, names, strict=True):
            assert isinstance(name, str)
            self.found.append(name)
            inside = _Walk((), numbered=False)
            for said, number in inside.numbers(one, place, depth + 1):
                yield f"{said}.{name}", number if why is None else why


def _doubled(names: Sequence[str]) -> str:
    """Return the message for names with a repetition."""
    twice = next(name for k, name in enumerate(names) if name in names[:k])
    return f"expected names that differ, got {short(twice)!r} twice"


def _number(value: Any) -> _Value:
    try:
        return float(value)
    except OverflowError:
        return "expected a number, got one with more digits than any measured"
