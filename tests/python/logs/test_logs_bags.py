"""Recordings of ROS as logs: joints by their names, times by their stamps."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from axisight import Robot, read_log
from axisight.errors import LogError, MissingExtraError
from axisight.logs import check_log, parse_column_map
from axisight.logs.sources import load_arrays
from axisight.robot_import import import_robot
from bag_data import START_NS, controller_states, written_states
from import_data import URDF, written

TIME = np.arange(300) / 100.0
NAMES = ["elbow", "shoulder"]  # ROS sorts them; the robot has them from its base on.
POSITION = np.column_stack([np.sin(TIME), np.cos(TIME)])
VELOCITY = np.column_stack([np.cos(TIME), -np.sin(TIME)])
EFFORT = np.column_stack([np.cos(3 * TIME), 5 * TIME])
STATES = (POSITION, VELOCITY, EFFORT)


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """Shoulder with a gear of fifty, elbow without."""
    return import_robot(written(tmp_path, URDF))


@pytest.mark.parametrize("kind", ["rosbag2", "mcap", "mcap file", "bag"])
def test_a_recording_is_the_log_that_was_written(tmp_path: Path, robot: Robot, kind: str):
    """Joints in the order of the robot, on the side of its motors: angles by 1/r, torques by r."""
    path = written_states(
        tmp_path / ("run.bag" if kind == "bag" else "run"), kind, TIME, NAMES, STATES
    )
    log = read_log(path, robot=robot)
    assert log.sample_time_s == pytest.approx(0.01)
    ratio = np.array([1 / 50, 1.0])
    np.testing.assert_allclose(log.position_rad, POSITION[:, ::-1] / ratio, rtol=1e-12)
    np.testing.assert_allclose(log.velocity_rad_s, VELOCITY[:, ::-1] / ratio, rtol=1e-12)
    np.testing.assert_allclose(log.torque_nm, EFFORT[:, ::-1] * ratio, rtol=1e-12)
    assert not any("resampled" in note for note in log.notes)
    # Without a robot nobody knows the gears; the check needs none.
    assert check_log(path).ok
    with pytest.raises(LogError, match="side: expected a robot"):
        read_log(path)


def test_stamps_that_wander_are_resampled_and_said(tmp_path: Path, robot: Robot):
    wander = TIME + 1e-3 * np.sin(40 * TIME)
    states = [
        np.column_stack([np.sin(wander), np.cos(wander)]),
        [],
        np.column_stack([wander, wander]),
    ]
    log = read_log(written_states(tmp_path / "run", "mcap", wander, NAMES, states), robot=robot)
    assert log.sample_time_s == pytest.approx(0.01)
    assert any("irregular stamps to 100 Hz" in note for note in log.notes)
    # A straight line between samples 10 ms apart is off by their square over eight.
    at = log.time_s + wander[0]
    np.testing.assert_allclose(log.position_rad[:, 1], np.sin(at), atol=1.3e-2**2 / 8 * 1.1)
    assert log.velocity_rad_s is None


def test_a_hole_is_not_bridged_unasked(tmp_path: Path, robot: Robot):
    keep = (TIME < 1.0) | (TIME > 1.2)
    states = [field[keep] for field in STATES]
    path = written_states(tmp_path / "run", "mcap", TIME[keep], NAMES, states)
    with pytest.raises(LogError, match=r"hole of 0\.2\d* s after 0\.99 s"):
        read_log(path, robot=robot)


def test_joints_are_found_by_name(tmp_path: Path, robot: Robot):
    """A gripper on the same topic is another series; one of other names is no arm."""
    path = written_states(tmp_path / "run", "mcap", TIME, ["a", "b"], STATES)
    with pytest.raises(
        LogError, match=r"effort of shoulder, elbow, or.*got none.*joint_states: a, b"
    ):
        read_log(path, robot=robot)
    no_effort = written_states(tmp_path / "bare", "mcap", TIME, NAMES, (POSITION, VELOCITY, []))
    with pytest.raises(LogError, match=r"got none \(topics that have both: none\)"):
        read_log(no_effort, robot=robot)

    def gripper(writer, types):
        connection = next(c for c in writer.connections if c.topic == "/joint_states")
        for k in range(200):
            stamp = START_NS + 15_000_000 * k
            state = types.types["sensor_msgs/msg/JointState"]
            header = types.types["std_msgs/msg/Header"](
                types.types["builtin_interfaces/msg/Time"](*divmod(stamp, 1_000_000_000)), ""
            )
            one = np.ones(1)
            message = state(header, ["finger"], one, one, one)
            raw = types.serialize_cdr(message, "sensor_msgs/msg/JointState")
            writer.write(connection, stamp, raw)

    both = written_states(tmp_path / "both", "mcap", TIME, NAMES, STATES, more=gripper)
    assert read_log(both, robot=robot).n_samples == len(TIME)


@pytest.mark.parametrize("age", ["new", "old"])
def test_states_of_a_trajectory_controller_are_targets_and_positions(
    tmp_path: Path, robot: Robot, age: str
):
    """They stand in where joint states have no effort, and do not where they have."""
    told = POSITION + 0.01
    more = controller_states(NAMES, TIME, told, POSITION, age)
    path = written_states(
        tmp_path / "run", "mcap", TIME, NAMES, (POSITION, VELOCITY, []), more=more
    )
    log = read_log(path, robot=robot)
    ratio = np.array([1 / 50, 1.0])
    assert not log.has_torque
    assert log.position_ref_rad is not None
    np.testing.assert_allclose(log.position_ref_rad, told[:, ::-1] / ratio, rtol=1e-12)
    np.testing.assert_allclose(log.position_rad, POSITION[:, ::-1] / ratio, rtol=1e-12)
    whole = written_states(tmp_path / "whole", "mcap", TIME, NAMES, STATES, more=more)
    assert read_log(whole, robot=robot).has_torque


@pytest.mark.parametrize("nothing", [0.0, np.nan])
def test_efforts_that_nobody_filled_hide_no_controller(
    tmp_path: Path, robot: Robot, nothing: float
):
    """Joint states with a dead effort, beside the states of a trajectory controller."""
    told = POSITION + 0.01
    more = controller_states(NAMES, TIME, told, POSITION, "new")
    states = (POSITION, VELOCITY, np.full_like(EFFORT, nothing))
    path = written_states(tmp_path / "run", "mcap", TIME, NAMES, states, more=more)
    log = read_log(path, robot=robot)
    assert not log.has_torque
    ratio = np.array([1 / 50, 1.0])
    np.testing.assert_allclose(log.position_ref_rad, told[:, ::-1] / ratio, rtol=1e-12)
    said = "efforts of joint_states are zero or NaN throughout and count as not logged"
    assert any(note.startswith(said) for note in log.notes)
    # Without targets, the efforts are all that there is.
    alone = written_states(tmp_path / "alone", "mcap", TIME, NAMES, states)
    if nothing == 0.0:
        assert read_log(alone, robot=robot).has_torque
    else:
        with pytest.raises(LogError, match="NaN"):
            read_log(alone, robot=robot)


def test_a_controller_with_speeds_and_a_dead_effort_is_read(tmp_path: Path, robot: Robot):
    """Efforts of NaN in the state of the controller itself, beside targets of speeds."""
    told = POSITION + 0.01
    more = controller_states(NAMES, TIME, told, POSITION, "new", speeds=VELOCITY, effort=np.nan)
    path = written_states(
        tmp_path / "run", "mcap", TIME, NAMES, (POSITION, VELOCITY, []), more=more
    )
    log = read_log(path, robot=robot)
    assert not log.has_torque
    assert log.position_ref_rad is not None
    assert log.velocity_ref_rad_s is not None


def test_two_topics_of_the_same_joints_need_a_map(tmp_path: Path, robot: Robot):
    def again(writer, types):
        connection = writer.add_connection(
            "/filtered/joint_states", "sensor_msgs/msg/JointState", typestore=types
        )
        state = types.types["sensor_msgs/msg/JointState"]
        for k in range(300):
            stamp = START_NS + 10_000_000 * k
            header = types.types["std_msgs/msg/Header"](
                types.types["builtin_interfaces/msg/Time"](*divmod(stamp, 1_000_000_000)), ""
            )
            message = state(header, NAMES, 2 * POSITION[k], VELOCITY[k], EFFORT[k])
            raw = types.serialize_cdr(message, "sensor_msgs/msg/JointState")
            writer.write(connection, stamp, raw)

    path = written_states(tmp_path / "run", "mcap", TIME, NAMES, STATES, more=again)
    with pytest.raises(LogError, match=r"got several.*filtered\.joint_states: elbow, shoulder"):
        read_log(path, robot=robot)
    axes = "".join(
        f"""[[axis]]
position = {{name = "filtered.joint_states.position.{name}", unit = "rad"}}
torque = {{name = "filtered.joint_states.effort.{name}", unit = "Nm"}}
"""
        for name in ("shoulder", "elbow")
    )
    columns = parse_column_map(
        f'side = "joint"\n[time]\nname = "filtered.joint_states.time_s"\n{axes}'
    )
    log = read_log(path, columns, robot=robot)
    np.testing.assert_allclose(log.position_rad[:, 1], 2 * POSITION[:, 0], rtol=1e-12)


def test_a_recording_cut_off_is_unreadable(tmp_path: Path, robot: Robot):
    path = written_states(tmp_path / "run", "mcap file", TIME, NAMES, STATES)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(LogError, match=r"truncated, corrupt.*file_unreadable"):
        read_log(path, robot=robot)
    other = written(tmp_path, b"nothing of that", "other.mcap")
    with pytest.raises(LogError, match="file_unreadable"):
        read_log(other, robot=robot)


def test_the_library_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def no(name: str):
        raise ImportError(name)

    monkeypatch.setattr("axisight.logs.sources_bag.import_module", no)
    with pytest.raises(MissingExtraError, match=r"axisight\[ros\]"):
        read_log(written(tmp_path, b"", "run.mcap"))


def test_a_wrench_is_read_beside_joints(tmp_path: Path, robot: Robot):
    """Every number of a WrenchStamped by its name, for column maps; the log is that of the joints."""
    wrench = "geometry_msgs/msg/WrenchStamped"

    def more(writer, types):
        connection = writer.add_connection("/wrist/wrench", wrench, typestore=types)
        known = types.types
        vector = known["geometry_msgs/msg/Vector3"]
        for k in range(50):
            stamp = START_NS + 20_000_000 * k
            when = known["builtin_interfaces/msg/Time"](*divmod(stamp, 1_000_000_000))
            inner = known["geometry_msgs/msg/Wrench"](vector(1.0, 2.0, k), vector(4.0, 5.0, -k))
            message = known[wrench](known["std_msgs/msg/Header"](when, "tool"), inner)
            writer.write(connection, stamp + 7_000_000, types.serialize_cdr(message, wrench))

    path = written_states(tmp_path / "run", "mcap", TIME, NAMES, STATES, more=more)
    arrays = load_arrays(path)
    np.testing.assert_array_equal(arrays["wrist.wrench.wrench.force.z"], np.arange(50))
    np.testing.assert_array_equal(arrays["wrist.wrench.wrench.torque.z"], -np.arange(50))
    np.testing.assert_allclose(arrays["wrist.wrench.time_s"], 0.02 * np.arange(50))
    assert sum(name.startswith("wrist.") for name in arrays) == 7
    assert read_log(path, robot=robot).n_samples == len(TIME)


@pytest.mark.parametrize("with_effort", [True, False])
def test_types_that_nobody_defines_are_named(tmp_path: Path, robot: Robot, with_effort: bool):
    """Recordings before ROS 2 Iron have no definitions, and the states of controllers none in the library."""
    states = STATES if with_effort else (POSITION, VELOCITY, [])
    more = controller_states(NAMES, TIME, POSITION, POSITION, "new")
    path = written_states(tmp_path / "run", "rosbag2", TIME, NAMES, states, more=more)
    (database,) = path.glob("*.db3")
    with sqlite3.connect(database) as tables:
        tables.execute("DELETE FROM message_definitions")
    said = (
        "left out topic /arm/state: nobody defines its type "
        "'?control_msgs/msg/JointTrajectoryControllerState"
    )
    if with_effort:
        assert any(re.match(said, note) for note in read_log(path, robot=robot).notes)
        assert any(re.match(said, finding.message) for finding in check_log(path).findings)
    else:
        with pytest.raises(LogError, match=f"got none .*; {said}"):
            read_log(path, robot=robot)
