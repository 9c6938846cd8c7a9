"""Recordings of ROS as named arrays: rosbag2 (SQLite, MCAP), ROS 1 bags, MCAP files alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import LogError, MissingExtraError
from axisight.logs.budget import Budget

BAG_SUFFIXES = (".mcap", ".bag", ".db3")
"""How files end that `load_bag` reads; a rosbag2 is a folder with ``metadata.yaml`` too."""

# Fields that hold the names of what the other arrays of a message have in order.
_NAMES = ("name", "joint_names")
# What is no signal: the header has the time.
_SKIPPED = ("header", *_NAMES)
_DEEPEST = 4
# Bytes that a number of a message takes until all messages are there.
_NUMBER_COST = 64


def is_bag(path: Path) -> bool:
    """Whether a path is a recording of ROS, by its name or as the folder of one."""
    return path.suffix.lower() in BAG_SUFFIXES or (path / "metadata.yaml").is_file()


def load_bag(path: Path, budget: Budget | None = None) -> dict[str, NDArray[Any]]:
    """Return the numbers of every topic of a recording by ``topic.field``, or ``topic.field.joint``.

    ``topic.time_s`` are the stamps of its messages, those of recording where they have none, from the
    first on. Messages of one topic that name other joints become ``topic#2``. Topics whose messages have no
    numbers, or a type that nobody defines, are left out. Numbers count against ``budget`` as messages
    come. Raises LogError and MissingExtraError.
    """
    budget = _own_budget(path) if budget is None else budget
    any_reader, stores = _rosbags()
    series: dict[tuple[str, frozenset[str]], _Series] = {}
    unknown: set[str] = set()
    with any_reader([path], default_typestore=stores) as reader:
        for connection, received_ns, raw in reader.messages():
            if connection.msgtype in unknown:
                continue
            try:
                message = reader.deserialize(raw, connection.msgtype)
            except KeyError:
                unknown.add(connection.msgtype)
                continue
            names = _names(message)
            topic = connection.topic.strip("/").replace("/", ".")
            one = series.setdefault((topic, frozenset(names)), _Series())
            row = dict(_numbers(message, names))
            budget.take(_NUMBER_COST * len(row))
            one.add(_stamp_ns(message, received_ns), row)
    out: dict[str, NDArray[Any]] = {}
    seen: dict[str, int] = {}
    for (topic, _), one in series.items():
        arrays = one.arrays()
        if arrays:
            seen[topic] = seen.get(topic, 0) + 1
            label = topic if seen[topic] == 1 else f"{topic}#{seen[topic]}"
            out |= {f"{label}.{name}": values for name, values in arrays.items()}
    if not out:
        said = f" (types nobody defines: {', '.join(sorted(unknown))})" if unknown else ""
        raise LogError(f"expected messages with numbers, got none{said}")
    return out


def _own_budget(path: Path) -> Budget:
    budget = Budget()
    budget.grow(path.iterdir() if path.is_dir() else [path])
    return budget


def _rosbags() -> tuple[Any, Any]:
    try:
        reader = import_module("rosbags.highlevel").AnyReader
        types = import_module("rosbags.typesys")
    except ImportError as error:
        raise MissingExtraError(
            "recordings of ROS are read by rosbags: pip install 'axisight[ros]'"
        ) from error
    # Recordings before ROS 2 Iron hold no definitions of their types.
    return reader, types.get_typestore(types.Stores.ROS2_HUMBLE)


@dataclass
class _Series:
    """Messages of one topic about the same joints."""

    stamps_ns: list[int] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)

    def add(self, stamp_ns: int, row: dict[str, float]) -> None:
        self.stamps_ns.append(stamp_ns)
        self.rows.append(row)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the columns that any message has, NaN where one lacks them; none without a column."""
        columns = dict.fromkeys(name for row in self.rows for name in row)
        if not columns:
            return {}
        stamps = np.array(self.stamps_ns, dtype=np.int64)
        out = {"time_s": (stamps - stamps[0]) * 1e-9}
        for name in columns:
            out[name] = np.array([row.get(name, np.nan) for row in self.rows])
        return out


def _names(message: Any) -> list[str]:
    for key in _NAMES:
        found = getattr(message, key, None)
        if isinstance(found, list | tuple) and all(isinstance(name, str) for name in found):
            return list(found)
    return []


def _stamp_ns(message: Any, received_ns: int) -> int:
    """Return when a message says that it was, when it was recorded where it does not."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return received_ns
    said = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
    return said or received_ns


def _numbers(
    message: Any, names: list[str], prefix: str = "", depth: int = 0
) -> Iterable[tuple[str, float]]:
    """Yield every number of a message with its name; of an array as long as the joints by joint."""
    for key in getattr(message, "__dataclass_fields__", {}):
        if key in _SKIPPED or key.startswith("__"):
            continue
        value = getattr(message, key)
        label = f"{prefix}{key}"
        if isinstance(value, bool | int | float | np.number):
            yield label, float(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
            if value.ndim == 1 and len(value) == len(names):
                yield from zip((f"{label}.{name}" for name in names), value.tolist(), strict=True)
        elif hasattr(value, "__dataclass_fields__") and depth < _DEEPEST:
            yield from _numbers(value, names, f"{label}.", depth + 1)
