"""Read MCAP files not recorded by ROS: messages in JSON, protobuf, or CDR with a definition of ROS 2."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from axisight.arguments import short
from axisight.errors import LogError, MissingExtraError
from axisight.logs.budget import Budget
from axisight.logs.cdr import decoder_of_ros2
from axisight.logs.messages import Topics, said_of

_MAGIC = b"\x89MCAP0\r\n"
# Sizes of magic, record kind, record length and profile length.
_HEAD, _LONGEST_PROFILE = 8 + 1 + 8 + 4, 64
# A longer message is an image or a point cloud.
_LONGEST_BYTES = 2**20
_DEEPEST = 8
_CDR = "cdr"
_Decoder = Callable[[bytes], Any]


def is_of_ros(path: Path) -> bool:
    """Whether a file has the MCAP profile of ROS 2, or is not MCAP, which the reader of ROS then reports."""
    with path.open("rb") as file:
        head = file.read(_HEAD + _LONGEST_PROFILE)
    length = int.from_bytes(head[_HEAD - 4 : _HEAD], "little")
    profile = head[_HEAD : _HEAD + length]
    return not head.startswith(_MAGIC) or len(head) < _HEAD or profile == b"ros2"


def read_mcap(path: Path, topics: Topics, budget: Budget) -> dict[str, list[str]]:
    """Add all messages in JSON, protobuf and CDR to ``topics``, and return the topics left out, by reason.

    Raises LogError, naming topic and time, for a message that cannot be decoded or when ``budget`` is spent.
    Raises MissingExtraError if the library for an encoding in the file is not installed.
    """
    make_reader = _library("mcap.reader", "MCAP files that are not of ROS").make_reader
    decoders: dict[int, _Decoder | str] = {}
    left_out: dict[str, list[str]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        chunks = summary.chunk_indexes if summary is not None else []
        # One chunk is in memory at a time, with the size that it declares.
        budget.take(max((chunk.uncompressed_size for chunk in chunks), default=0))
        for schema, channel, message in reader.iter_messages():
            if channel.id not in decoders:
                decoders[channel.id] = _decoder(schema, channel)
            decode = decoders[channel.id]
            if len(message.data) > _LONGEST_BYTES and not isinstance(decode, str):
                decode = f"it has messages of more than {_LONGEST_BYTES} bytes"
                decoders[channel.id] = decode
                topics.drop(channel.topic)
            if isinstance(decode, str):
                names = left_out.setdefault(decode, [])
                if channel.topic not in names:
                    names.append(channel.topic)
                continue
            said = said_of(channel.topic, message.log_time)
            # For CDR as in ROS recordings: arrays without names are left out.
            numbered = channel.message_encoding != _CDR
            decoded = _decoded(decode, message.data, said)
            topics.add(channel.topic, message.log_time, decoded, numbered=numbered)
    return left_out


def _decoded(decode: _Decoder, data: bytes, said: str) -> Any:
    """Return a decoded message; raise LogError, beginning with ``said``, if that fails."""
    try:
        return decode(data)
    except RecursionError:
        raise LogError(f"{said}: expected a message, got one that is nested too deeply") from None
    except Exception as error:  # damaged messages make decoders raise nearly anything
        raise LogError(
            f"{said}: expected a whole message, got one that cannot be decoded: {short(str(error), 120)}"
        ) from None


def _decoder(schema: Any, channel: Any) -> _Decoder | str:
    """Return a decoder for the messages of a channel, or the reason why there is none."""
    encoding = channel.message_encoding
    if encoding == "json":
        return _of_json
    if encoding == _CDR:
        return decoder_of_ros2(schema, channel.topic)
    if encoding != "protobuf":
        return f"expected messages in json, protobuf or cdr, got {short(encoding)!r}"
    library = _library(
        "mcap_protobuf.decoder", f"topic {short(channel.topic)}: messages in protobuf"
    )
    try:
        found = library.DecoderFactory().decoder_for(encoding, schema)
    except Exception as error:  # damaged schemas make the library raise nearly anything
        raise LogError(
            f"topic {short(channel.topic)}: expected a schema of protobuf, got one that cannot be used: "
            f"{short(str(error), 120)}"
        ) from None
    if found is None:
        return "expected a schema of protobuf with messages in protobuf, got none"
    return lambda data: _plain(found(data))


def _of_json(data: bytes) -> Any:
    """Return a message in JSON; null in an array of numbers becomes NaN."""
    return _with_nan(json.loads(data.decode("utf-8")))


def _with_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _with_nan(one) for key, one in value.items()}
    if isinstance(value, list):
        numbers = all(one is None or isinstance(one, bool | int | float) for one in value)
        if numbers:
            return [float("nan") if one is None else one for one in value]
        return [_with_nan(one) for one in value]
    return value


def _plain(message: Any, depth: int = 0) -> Mapping[str, Any]:
    """Return a protobuf message as a dictionary; numbers that were not sent are 0, as protobuf defines."""
    out: dict[str, Any] = {}
    if depth > _DEEPEST:
        return out
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        nested = field.message_type is not None
        if nested and field.message_type.GetOptions().map_entry:
            continue
        if _repeated(field):
            out[field.name] = [_plain(one, depth + 1) for one in value] if nested else list(value)
        elif field.has_presence and not message.HasField(field.name):
            continue
        else:
            out[field.name] = _plain(value, depth + 1) if nested else value
    return out


def _repeated(field: Any) -> bool:
    """Whether a field holds several values; newer libraries have `is_repeated` in place of labels."""
    said = getattr(field, "is_repeated", None)
    return bool(field.label == field.LABEL_REPEATED if said is None else said)


def _library(name: str, what: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(
            f"{what} are read by the libraries of MCAP: pip install 'axisight[mcap]'"
        ) from error
