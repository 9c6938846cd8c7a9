"""MCAP files with messages of ROS 2 that are not of ROS: read as its own recordings are."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight import Robot, read_log
from axisight.errors import LogError, MissingExtraError
from axisight.logs.sources import load_arrays
from axisight.robot_import import import_robot
from bag_data import START_NS, controller_states, written_states
from import_data import URDF
from import_data import written as written_file
from mcap_data import JOINT_STATE_IDL, Definition, not_of_ros

TIME = np.arange(300) / 100.0
NAMES = ["elbow", "shoulder"]
STATES = tuple(np.column_stack([np.sin(k * TIME), np.cos(k * TIME)]) for k in (1, 2, 3))
SEPARATOR = "=" * 80 + "\n"
# Of each type by itself.
IDL = [f"{part}}}; }};\n" for part in JOINT_STATE_IDL.split("}; };\n")[:-1]]


def bare_arrays(writer: Any, types: Any) -> None:
    """Write arrays without names, of which recordings of ROS have no columns."""
    kind = "std_msgs/msg/Float64MultiArray"
    connection = writer.add_connection("/bare", kind, typestore=types)
    layout = types.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    message = types.types[kind](layout, np.array([1.0, 2.0]))
    writer.write(connection, START_NS, types.serialize_cdr(message, kind))


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Joint states, targets of a controller, whose type ROS does not know by itself, and arrays without names."""
    targets = controller_states(NAMES, TIME, 0.5 * STATES[0], STATES[0], "new")

    def more(writer: Any, types: Any) -> None:
        targets(writer, types)
        bare_arrays(writer, types)

    return written_states(tmp_path / "run", "mcap file", TIME, NAMES, STATES, more=more)


@pytest.fixture
def states(tmp_path: Path) -> Path:
    """Joint states alone."""
    return written_states(tmp_path / "states", "mcap file", TIME, NAMES, STATES)


def assert_same(path: Path, recording: Path) -> None:
    """All columns, bit by bit."""
    found, want = load_arrays(path), load_arrays(recording)
    assert set(found) == set(want)
    assert found.doubts == want.doubts
    for name in want:
        np.testing.assert_array_equal(found[name], want[name], err_msg=name)


@pytest.mark.parametrize("profile", ["", "ros1", "somebody's"])
def test_the_columns_are_those_of_the_recording(
    tmp_path: Path, recording: Path, profile: str
) -> None:
    path = not_of_ros(tmp_path / "own.mcap", recording, profile=profile)
    assert_same(path, recording)
    robot: Robot = import_robot(written_file(tmp_path, URDF))
    log, want = read_log(path, robot=robot), read_log(recording, robot=robot)
    np.testing.assert_array_equal(log.position_rad, want.position_rad)
    np.testing.assert_array_equal(log.torque_nm, want.torque_nm)


@pytest.mark.parametrize(
    "definition",
    [
        Definition(encoding="ros2idl", text=JOINT_STATE_IDL),
        # One after another, each with its name, as recordings have them that were made of IDL.
        Definition(encoding="ros2idl", text="".join(f"{SEPARATOR}IDL: a/msg/B\n{x}" for x in IDL)),
        # As ROS 1 writes its names.
        Definition(name="sensor_msgs/JointState"),
        # As before ROS 2 Iron: the library knows the type.
        Definition(text=""),
    ],
    ids=["idl", "several", "short name", "no text"],
)
def test_a_type_is_found_by_its_definition(
    tmp_path: Path, states: Path, definition: Definition
) -> None:
    assert_same(not_of_ros(tmp_path / "own.mcap", states, definition=definition), states)


def test_other_encodings_may_stand_beside_it(tmp_path: Path, recording: Path) -> None:
    """Arrays without names are numbered where they are JSON, and not where they are of ROS."""
    beside = {"/own": [(time, {"tau": [time, 2 * time]}) for time in TIME]}
    arrays = load_arrays(not_of_ros(tmp_path / "own.mcap", recording, beside=beside))
    np.testing.assert_array_equal(arrays["own.tau.1"], 2 * TIME)
    names = {name for name in arrays if not name.startswith("own.")}
    assert names == set(load_arrays(recording))


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        (
            Definition(name="my_msgs/msg/State", text=""),
            "nobody defines its type my_msgs/msg/State",
        ),
        (
            Definition(text="std_msgs/Header header"),
            "nobody defines its type sensor_msgs/msg/JointState",
        ),
        (
            Definition(encoding="omgidl", text=JOINT_STATE_IDL),
            r"expected a schema of ROS 2 \(ros2msg, ros2idl\) with messages in cdr, got 'omgidl'",
        ),
        (
            Definition(text="float64 [["),
            "topic /joint_states: expected a definition of ROS 2, got one that cannot be used",
        ),
    ],
)
def test_what_is_not_defined_is_said_by_topic(
    tmp_path: Path, states: Path, definition: Definition, said: str
) -> None:
    path = not_of_ros(tmp_path / "own.mcap", states, definition=definition)
    with pytest.raises(LogError, match=said):
        load_arrays(path)


def test_a_message_that_is_cut_off_is_said_by_topic_and_time(tmp_path: Path, states: Path) -> None:
    path = not_of_ros(tmp_path / "own.mcap", states, spoiled={7: b"\x00\x01\x00\x00\x05"})
    said = r"topic /joint_states: message of 1700000000\.070300 s: expected a whole message"
    with pytest.raises(LogError, match=said):
        load_arrays(path)


def test_the_library_is_named_where_it_is_missing(
    tmp_path: Path, states: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def some(name: str) -> Any:
        if name.startswith("rosbags"):
            raise ImportError(name)
        return import_module(name)

    path = not_of_ros(tmp_path / "own.mcap", states)
    monkeypatch.setattr("axisight.logs.cdr.import_module", some)
    with pytest.raises(MissingExtraError, match=r"topic /joint_states.*axisight\[ros\]"):
        load_arrays(path)
