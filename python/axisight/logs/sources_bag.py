"""Read recordings as named arrays: rosbag2 (SQLite, MCAP), ROS 1 bags, and MCAP files with or without ROS."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from axisight.arguments import short
from axisight.errors import LogError, MissingExtraError
from axisight.logs.budget import Budget
from axisight.logs.lazy import LazyArrays
from axisight.logs.messages import Topics
from axisight.logs.sources_mcap import is_of_ros, read_mcap

BAG_SUFFIXES = (".mcap", ".bag", ".db3")
"""Suffixes of files that `load_bag` reads; a folder with ``metadata.yaml`` is a recording too."""

_MOST_SAID = 8


def is_bag(path: Path) -> bool:
    """Whether a path is a recording: by its suffix, or as a folder with ``metadata.yaml``."""
    return path.suffix.lower() in BAG_SUFFIXES or (path / "metadata.yaml").is_file()


def load_bag(path: Path, budget: Budget | None = None) -> LazyArrays:
    """Return the numbers of every topic of a recording by ``topic.field``, or ``topic.field.joint``.

    ``topic.time_s`` is the time (s) since the first message, from the stamps of the messages, or from the
    time of recording if they have none. Messages of one topic that name other joints become ``topic#2``.
    Topics without numbers are left out. Topics of an undefined type or an unsupported encoding are left out
    as well, and the doubts say so. Numbers count against ``budget``.

    Raises LogError if no topic has numbers or the budget is spent, MissingExtraError if the library for the
    recording is not installed.
    """
    budget = _own_budget(path) if budget is None else budget
    topics = Topics(budget)
    if path.suffix.lower() == ".mcap" and path.is_file() and not is_of_ros(path):
        left_out = read_mcap(path, topics, budget)
    else:
        left_out = _read_ros(path, topics)
    readers = topics.readers()
    doubts = tuple(
        f"left out {'topics' if len(names) > 1 else 'topic'} {_listed(names)}: {why}"
        for why, names in left_out.items()
    )
    if not readers:
        said = f" ({'; '.join(doubts)})" if doubts else ""
        raise LogError(f"expected messages with numbers, got none{said}")
    return LazyArrays(readers, doubts)


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _MOST_SAID} more" if len(names) > _MOST_SAID else ""
    return f"{', '.join(map(short, sorted(names)[:_MOST_SAID]))}{more}"


def _own_budget(path: Path) -> Budget:
    budget = Budget()
    budget.grow(path.iterdir() if path.is_dir() else [path])
    return budget


def _read_ros(path: Path, topics: Topics) -> dict[str, list[str]]:
    """Add all messages to ``topics`` and return the topics left out, by reason."""
    any_reader, stores = _rosbags()
    unknown: set[str] = set()
    left_out: dict[str, list[str]] = {}
    with any_reader([path], default_typestore=stores) as reader:
        for connection, received_ns, raw in reader.messages():
            if connection.topic in unknown:
                continue
            try:
                message = reader.deserialize(raw, connection.msgtype)
            except KeyError:
                unknown.add(connection.topic)
                why = f"nobody defines its type {short(connection.msgtype)}"
                left_out.setdefault(why, []).append(connection.topic)
                continue
            topics.add(connection.topic, received_ns, message)
    return left_out


def _rosbags() -> tuple[Any, Any]:
    try:
        reader = import_module("rosbags.highlevel").AnyReader
        types = import_module("rosbags.typesys")
    except ImportError as error:
        raise MissingExtraError(
            "recordings of ROS are read by rosbags: pip install 'axisight[ros]'"
        ) from error
    # Recordings before ROS 2 Iron do not contain the definitions of their types.
    return reader, types.get_typestore(types.Stores.ROS2_HUMBLE)
