"""Write the signals of all logs as an MCAP recording of joint states, for tools of ROS."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import MissingExtraError
from axisight.signal_files.about import about
from axisight.signal_files.topics import POSITION, TORQUE, prefixes

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
            for prefix, data in zip(prefixes(signals), signals, strict=True):
                _write(writer, types, prefix, data)
        return next(bag.glob("*.mcap")).read_bytes()


def _write(writer: Any, types: Any, prefix: str, data: xr.Dataset) -> None:
    """Write the signals of a log: a topic for measured, simulated and residual, with torques and positions."""
    known = types.types
    joints = [str(name) for name in data["joint"].values]
    stamps = _START_NS + np.round(data["time_s"].values * 1e9).astype(np.int64)
    nothing = np.zeros(0)
    for base in (str(name).removesuffix(TORQUE) for name in data if str(name).endswith(TORQUE)):
        connection = writer.add_connection(f"{prefix}/{base}", _STATE, typestore=types)
        efforts = _rows(data, base + TORQUE)
        positions = _rows(data, base + POSITION)
        for i, stamp in enumerate(stamps.tolist()):
            seconds, rest = divmod(stamp, 1_000_000_000)
            time = known["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)
            header = known["std_msgs/msg/Header"](stamp=time, frame_id="")
            message = known[_STATE](header, joints, positions[i], nothing, efforts[i])
            writer.write(connection, stamp, types.serialize_cdr(message, _STATE))


def _rows(data: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Return a signal (n, n_axes), or (n, 0) if the log has none, contiguous as messages need it."""
    if name not in data:
        return np.zeros((data.sizes["time_s"], 0))
    # Filtered signals may be stored by column.
    return np.ascontiguousarray(data[name].values)
