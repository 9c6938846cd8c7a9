"""Decode ROS 2 messages (CDR) in files not recorded by ROS, from the type definitions in the file."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from axisight.arguments import short
from axisight.errors import LogError, MissingExtraError

SCHEMAS = ("ros2msg", "ros2idl")
"""Schema encodings of ROS 2 type definitions."""
# These lines begin each definition if an IDL text has several.
_SEPARATOR = "=" * 80 + "\n"
_HEAD = "IDL: "


def decoder_of_ros2(schema: Any, topic: str) -> Callable[[bytes], Any] | str:
    """Return a decoder for the CDR messages of a channel, or the reason why there is none.

    A schema without text must name a standard type of ROS 2 Humble. Raises LogError for a definition that
    cannot be used, MissingExtraError if rosbags is not installed.
    """
    if schema is None or schema.encoding not in SCHEMAS:
        got = "none" if schema is None else repr(short(schema.encoding))
        return f"expected a schema of ROS 2 ({', '.join(SCHEMAS)}) with messages in cdr, got {got}"
    types = _types(topic)
    try:
        store = _store(types, schema)
    except Exception as error:  # damaged definitions make the parser raise nearly anything
        raise LogError(
            f"topic {short(topic)}: expected a definition of ROS 2, got one that cannot be used: "
            f"{short(str(error), 120)}"
        ) from None
    for name in (schema.name, schema.name.replace("/", "/msg/", 1)):
        try:
            store.get_msgdef(name)
        except KeyError:
            continue
        return lambda data: store.deserialize_cdr(data, name)
    return f"nobody defines its type {short(schema.name)}"


def _store(types: Any, schema: Any) -> Any:
    """Return a type store with the types of a schema, or with those of ROS 2 Humble if it has no text."""
    text = schema.data.decode("utf-8")
    if not text.strip():
        return types.get_typestore(types.Stores.ROS2_HUMBLE)
    store = types.get_typestore(types.Stores.EMPTY)
    if schema.encoding == "ros2msg":
        store.register(types.get_types_from_msg(text, schema.name))
        return store
    parts = [text]
    if text.startswith(_SEPARATOR + _HEAD):
        parts = [part.split("\n", 1)[1] for part in text.split(_SEPARATOR)[1:]]
    found: dict[str, Any] = {}
    for part in parts:
        found |= types.get_types_from_idl(part)
    store.register(found)
    return store


def _types(topic: str) -> Any:
    try:
        return import_module("rosbags.typesys")
    except ImportError as error:
        raise MissingExtraError(
            f"topic {short(topic)}: messages of ROS 2 are read by rosbags: pip install 'axisight[ros]'"
        ) from error
