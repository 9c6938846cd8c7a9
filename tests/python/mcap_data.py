"""MCAP files for tests, written by the format's own library: messages in JSON, protobuf and CDR."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mcap", reason="needs axisight[mcap]")
pytest.importorskip("mcap_protobuf", reason="needs axisight[mcap]")

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from mcap_protobuf.writer import Writer as ProtobufWriter

START_NS = 1_700_000_000_000_000_000
_TYPES = descriptor_pb2.FieldDescriptorProto


def stamp(time_s: float) -> dict[str, int]:
    """Return a time in Foxglove's JSON form."""
    seconds, rest = divmod(START_NS + round(time_s * 1e9), 1_000_000_000)
    return {"sec": seconds, "nsec": rest}


def written_json(
    path: Path,
    topics: Mapping[str, Iterable[tuple[float, Any]]],
    *,
    encoding: str = "json",
    late_ns: int = 300_000,
) -> Path:
    """Write messages of topics, each (time [s], message), as recorded ``late_ns`` later.

    Texts and bytes are written unchanged.
    """
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="", library="test")
        for topic, messages in topics.items():
            schema = writer.register_schema(topic, "jsonschema", b'{"type": "object"}')
            channel = writer.register_channel(topic, encoding, schema)
            for time_s, message in messages:
                text = message if isinstance(message, str | bytes) else json.dumps(message)
                data = text if isinstance(text, bytes) else text.encode()
                when = START_NS + round(time_s * 1e9) + late_ns
                writer.add_message(channel, when, data, when)
        writer.finish()
    return path


def _field(name: str, number: int, kind: int, *, many: bool = False, of: str = "") -> Any:
    label = _TYPES.LABEL_REPEATED if many else _TYPES.LABEL_OPTIONAL
    made = _TYPES(name=name, number=number, type=kind, label=label)
    if of:
        made.type_name = of
    return made


def protobuf_types() -> dict[str, Any]:
    """Return classes by name: foxglove.JointStates by its documentation, and flat arrays by joint."""
    file = descriptor_pb2.FileDescriptorProto(
        name="states.proto",
        package="foxglove",
        syntax="proto3",
        dependency=["google/protobuf/timestamp.proto"],
    )
    joint = file.message_type.add(name="JointState")
    joint.field.append(_field("name", 1, _TYPES.TYPE_STRING))
    for number, name in enumerate(("position", "velocity", "effort"), 2):
        field = _field(name, number, _TYPES.TYPE_DOUBLE)
        field.proto3_optional, field.oneof_index = True, number - 2
        joint.field.append(field)
        joint.oneof_decl.add(name=f"_{name}")
    time = _field("timestamp", 1, _TYPES.TYPE_MESSAGE, of=".google.protobuf.Timestamp")
    states = file.message_type.add(name="JointStates")
    inner = _field("joints", 2, _TYPES.TYPE_MESSAGE, many=True, of=".foxglove.JointState")
    states.field.extend([time, inner])
    flat = file.message_type.add(name="Flat")
    flat.field.extend([time, _field("name", 2, _TYPES.TYPE_STRING, many=True)])
    for number, name in enumerate(("position", "velocity", "effort"), 3):
        flat.field.append(_field(name, number, _TYPES.TYPE_DOUBLE, many=True))
    flat.field.append(_field("temperature", 6, _TYPES.TYPE_FLOAT))
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"foxglove.{name}"))
        for name in ("JointStates", "JointState", "Flat")
    }


def written_protobuf(path: Path, topic: str, messages: Iterable[tuple[float, Any]]) -> Path:
    """Write messages of a topic."""
    with path.open("wb") as file, ProtobufWriter(file) as writer:
        for time_s, message in messages:
            when = START_NS + round(time_s * 1e9) + 300_000
            writer.write_message(topic=topic, message=message, log_time=when, publish_time=when)
    return path


# sensor_msgs/msg/JointState as ROS 2 generates it.
JOINT_STATE_IDL = """\
module builtin_interfaces { module msg {
  struct Time { int32 sec; uint32 nanosec; };
}; };
module std_msgs { module msg {
  struct Header { builtin_interfaces::msg::Time stamp; string frame_id; };
}; };
module sensor_msgs { module msg {
  struct JointState {
    std_msgs::msg::Header header;
    sequence<string> name;
    sequence<double> position;
    sequence<double> velocity;
    sequence<double> effort;
  };
}; };
"""


@dataclass(frozen=True)
class Definition:
    """Changes to a type's stored definition in an MCAP file; None keeps what ROS 2 records."""

    name: str | None = None
    encoding: str | None = None
    text: str | None = None


def not_of_ros(
    path: Path,
    recording: Path,
    *,
    profile: str = "",
    definition: Definition = Definition(),
    beside: Mapping[str, Iterable[tuple[float, Any]]] | None = None,
    spoiled: Mapping[int, bytes] | None = None,
) -> Path:
    """Write the MCAP file of a ROS 2 recording in another program's form, with JSON topics ``beside``.

    ``spoiled``: replacement bytes of messages, by message number.
    """
    with recording.open("rb") as source, path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile=profile, library="test")
        channels: dict[int, int] = {}
        for k, (schema, channel, message) in enumerate(make_reader(source).iter_messages()):
            assert schema is not None
            if channel.id not in channels:
                kept = writer.register_schema(
                    definition.name or schema.name,
                    definition.encoding or schema.encoding,
                    schema.data if definition.text is None else definition.text.encode(),
                )
                channels[channel.id] = writer.register_channel(channel.topic, "cdr", kept)
            data = (spoiled or {}).get(k, message.data)
            writer.add_message(channels[channel.id], message.log_time, data, message.log_time)
        for topic, messages in (beside or {}).items():
            kept = writer.register_schema(topic, "jsonschema", b'{"type": "object"}')
            other = writer.register_channel(topic, "json", kept)
            for time_s, value in messages:
                when = START_NS + round(time_s * 1e9)
                writer.add_message(other, when, json.dumps(value).encode(), when)
        writer.finish()
    return path
