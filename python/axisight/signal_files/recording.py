"""Write the signals of all logs as an MCAP recording of joint states, for tools of ROS."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from axisight.errors import MissingExtraError
from axisight.signal_files.about import about

_STATE = "sensor_msgs/msg/JointState"
_STRING = "std_msgs/msg/String"
# Not 0: in ROS a stamp of zero means no stamp.
_START_NS = 1_000_000_000


def recording(signals: Sequence[xr.Dataset]) -> bytes:
    """Return the bytes of an MCAP file of the signals; raise MissingExtraError without rosbags."""
    try:
        bags = import_module("rosbags.rosbag2")
        typesys = import_module("rosbags.typesys")
    except ImportError as error:
        raise MissingExtraError(
            "MCAP files are written by rosbags: pip install 'axisight[ros]'"
        ) from error
    types = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "signals"
        with bags.Writer(bag, version=9, storage_plugin=bags.StoragePlugin.MCAP) as writer:
            said = writer.add_connection("/axisight", _STRING, typestore=types)
            text = types.types[_STRING](about(signals))
            writer.write(said, _START_NS, types.serialize_cdr(text, _STRING))
            seen: set[str] = set()
            for data in signals:
                _write(writer, types, _folder(data, seen), data)
        return next(bag.glob("*.mcap")).read_bytes()


def _write(writer: Any, types: Any, folder: str, data: xr.Dataset) -> None:
    """Write the signals of a log, one topic per signal."""
    known = types.types
    joints = [str(name) for name in data["joint"].values]
    stamps = _START_NS + np.round(data["time_s"].values * 1e9).astype(np.int64)
    nothing = np.zeros(0)
    for name in data.data_vars:
        topic = f"{folder}/{str(name).removesuffix('_torque_nm')}"
        connection = writer.add_connection(topic, _STATE, typestore=types)
        # Messages need contiguous rows, but filtered signals may be stored by column.
        efforts = np.ascontiguousarray(data[name].values)
        for stamp, effort in zip(stamps.tolist(), efforts, strict=True):
            seconds, rest = divmod(stamp, 1_000_000_000)
            time = known["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)
            header = known["std_msgs/msg/Header"](stamp=time, frame_id="")
            message = known[_STATE](header, joints, nothing, nothing, effort)
            writer.write(connection, stamp, types.serialize_cdr(message, _STATE))


def _folder(data: xr.Dataset, seen: set[str]) -> str:
    """Return a unique prefix for the topics of a log, with characters that topics allow."""
    name = re.sub(r"\W", "_", str(data.attrs["log"]), flags=re.ASCII)
    # In ROS each part of a topic must begin with a letter.
    base = f"/{data.attrs['role']}/{name if name[:1].isalpha() else f'log_{name}'}"
    found, number = base, 1
    while found in seen:
        number += 1
        found = f"{base}_{number}"
    seen.add(found)
    return found
