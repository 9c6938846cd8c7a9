"""ROS recordings for tests: joint states of a log as rosbag2, MCAP or ROS 1 bag."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

Array = NDArray[np.float64]
ROS2, ROS1 = get_typestore(Stores.ROS2_JAZZY), get_typestore(Stores.ROS1_NOETIC)
STATE = "sensor_msgs/msg/JointState"
START_NS = 1_700_000_000_000_000_000


def joint_state(
    types: Any, stamp_ns: int, names: Sequence[str], fields: Sequence[Array], sequence: int
) -> Any:
    """Return a joint state message; ``fields`` are position, velocity and effort."""
    known = types.types
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    stamp = known["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)
    header = {"stamp": stamp, "frame_id": ""}
    if types is ROS1:
        header["seq"] = sequence
    return known[STATE](
        known["std_msgs/msg/Header"](**header),
        list(names),
        *(np.asarray(field, dtype=np.float64) for field in fields),
    )


def written_states(
    path: Path,
    kind: str,
    time_s: Array,
    names: Sequence[str],
    fields: Sequence[Array],
    *,
    topic: str = "/joint_states",
    more: Callable[[Any, Any], None] | None = None,
) -> Path:
    """Write joint states and return the path to read: a folder, or a file of ``kind`` mcap or bag.

    ``fields``: position, velocity, effort (n, n_joints), each may be empty. ``more(writer, types)`` may write
    further topics.
    """
    types = ROS1 if kind == "bag" else ROS2
    plugin = StoragePlugin.SQLITE3 if kind == "rosbag2" else StoragePlugin.MCAP
    made = Writer1(path) if kind == "bag" else Writer2(path, version=9, storage_plugin=plugin)
    with made as writer:
        connection = writer.add_connection(topic, STATE, typestore=types)
        for k, time in enumerate(time_s):
            stamp = START_NS + round(time * 1e9)
            message = joint_state(types, stamp, names, [f[k] if len(f) else [] for f in fields], k)
            serialize = types.serialize_ros1 if kind == "bag" else types.serialize_cdr
            writer.write(connection, stamp + 300_000, serialize(message, STATE))
        if more is not None:
            more(writer, types)
    return next(path.glob("*.mcap")) if kind == "mcap file" else path


CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
_POINTS = {"new": ("reference", "feedback"), "old": ("desired", "actual")}


def controller_states(
    names: Sequence[str],
    time_s: Array,
    told: Array,
    done: Array,
    age: str,
    *,
    speeds: Array | None = None,
    effort: float | None = None,
) -> Callable[[Any, Any], None]:
    """Return a function that writes a trajectory controller's targets and positions (n, n_joints).

    ``age``: ``new`` or ``old`` names of the message's points. ``speeds`` (n, n_joints) are those of all points,
    and ``effort`` is that of all joints and times; without them the messages have none.
    """
    points = _POINTS[age]
    fields = [f"trajectory_msgs/JointTrajectoryPoint {point}" for point in (*points, "error")]
    text = "\n".join(["std_msgs/Header header", "string[] joint_names", *fields])

    def write(writer: Any, types: Any) -> None:
        types = get_typestore(Stores.ROS2_JAZZY)
        types.register(get_types_from_msg(text, CONTROLLER_STATE))
        known = types.types
        connection = writer.add_connection("/arm/state", CONTROLLER_STATE, typestore=types)
        for k, time in enumerate(time_s):
            stamp = START_NS + round(time * 1e9)
            when = known["builtin_interfaces/msg/Time"](*divmod(stamp, 1_000_000_000))
            still = known["builtin_interfaces/msg/Duration"](0, 0)
            none = np.zeros(0)
            speed = none if speeds is None else speeds[k]
            force = none if effort is None else np.full(len(names), effort)
            rows = [
                known["trajectory_msgs/msg/JointTrajectoryPoint"](row, speed, none, force, still)
                for row in (told[k], done[k], told[k] - done[k])
            ]
            message = known[CONTROLLER_STATE](
                known["std_msgs/msg/Header"](when, ""), list(names), *rows
            )
            writer.write(connection, stamp, types.serialize_cdr(message, CONTROLLER_STATE))

    return write
