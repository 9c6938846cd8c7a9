"""MCAP files of JSON and protobuf: joints by their names, times by their stamps, what is wrong by its place."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight import Robot, read_log
from axisight.errors import LogError, MissingExtraError
from axisight.logs import check_log, parse_column_map
from axisight.logs.sources import load_arrays
from axisight.robot_import import import_robot
from import_data import URDF
from import_data import written as written_file
from mcap_data import protobuf_types, stamp, written_json, written_protobuf

TIME = np.arange(300) / 100.0
NAMES = ["elbow", "shoulder"]
POSITION = np.column_stack([np.sin(TIME), np.cos(TIME)])
VELOCITY = np.column_stack([np.cos(TIME), -np.sin(TIME)])
EFFORT = np.column_stack([np.cos(3 * TIME), 5 * TIME])
FIELDS = ("position", "velocity", "effort")


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """Shoulder with a gear of fifty, elbow without."""
    return import_robot(written_file(tmp_path, URDF))


def flat(k: int) -> dict[str, Any]:
    """Return the state as flat lists, as rosbridge and scripts write it."""
    values = (POSITION, VELOCITY, EFFORT)
    lists = {key: of[k].tolist() for key, of in zip(FIELDS, values, strict=True)}
    return {"header": {"stamp": stamp(TIME[k]), "frame_id": ""}, "name": NAMES, **lists}


def foxglove(k: int) -> dict[str, Any]:
    """Return the state as foxglove.JointStates."""
    joints = [
        {
            "name": name,
            "position": POSITION[k, i],
            "velocity": VELOCITY[k, i],
            "effort": EFFORT[k, i],
        }
        for i, name in enumerate(NAMES)
    ]
    return {"timestamp": stamp(TIME[k]), "joints": joints}


def messages(make=flat) -> list[tuple[float, Any]]:
    return [(time, make(k)) for k, time in enumerate(TIME)]


def is_the_log(path: Path, robot: Robot) -> None:
    """Joints in the order of the robot, on the side of its motors: angles by 1/r, torques by r."""
    log = read_log(path, robot=robot)
    assert log.sample_time_s == pytest.approx(0.01)
    ratio = np.array([1 / 50, 1.0])
    assert log.velocity_rad_s is not None
    np.testing.assert_allclose(log.position_rad, POSITION[:, ::-1] / ratio, rtol=1e-12)
    np.testing.assert_allclose(log.velocity_rad_s, VELOCITY[:, ::-1] / ratio, rtol=1e-12)
    np.testing.assert_allclose(log.torque_nm, EFFORT[:, ::-1] * ratio, rtol=1e-12)
    assert check_log(path).ok


@pytest.mark.parametrize("make", [flat, foxglove])
def test_json_is_the_log_that_was_written(tmp_path: Path, robot: Robot, make):
    """With another topic beside it, and one in an encoding that is not read."""
    beside = {"/battery": [(0.1 * k, {"volts": 24.0 - k, "note": "text"}) for k in range(9)]}
    path = written_json(tmp_path / "run.mcap", {"/arm/joints": messages(make), **beside})
    is_the_log(path, robot)
    arrays = load_arrays(path)
    np.testing.assert_allclose(arrays["battery.volts"], 24.0 - np.arange(9))
    # Without a stamp the time is that of recording.
    np.testing.assert_allclose(arrays["battery.time_s"], 0.1 * np.arange(9), atol=1e-9)
    assert "battery.note" not in arrays


@pytest.mark.parametrize("kind", ["Flat", "JointStates"])
def test_protobuf_is_the_log_that_was_written(tmp_path: Path, robot: Robot, kind: str):
    types = protobuf_types()

    def make(k: int) -> Any:
        message = types[kind]()
        message.timestamp.seconds, message.timestamp.nanos = stamp(TIME[k]).values()
        values = (POSITION[k], VELOCITY[k], EFFORT[k])
        if kind == "Flat":
            message.name.extend(NAMES)
            for key, of in zip(FIELDS, values, strict=True):
                getattr(message, key).extend(of)
            return message
        for i, name in enumerate(NAMES):
            joint = message.joints.add(name=name)
            for key, of in zip(FIELDS, values, strict=True):
                # At the first sample an effort is zero: said all the same.
                setattr(joint, key, of[i])
        return message

    path = written_protobuf(tmp_path / "run.mcap", "/arm/joints", messages(make))
    is_the_log(path, robot)
    if kind == "Flat":
        # A number that was not set is the zero that it means.
        assert not load_arrays(path)["arm.joints.temperature"].any()


def test_arrays_without_names_are_numbered(tmp_path: Path):
    """For a column map: robots of research log {"q": [...], "tau": [...]}."""
    rows = [
        (t, {"q": POSITION[k].tolist(), "s": {"tau": EFFORT[k].tolist()}})
        for k, t in enumerate(TIME)
    ]
    path = written_json(tmp_path / "run.mcap", {"state": rows})
    columns = parse_column_map(
        """[time]
name = "state.time_s"
[[axis]]
position = {name = "state.q.1", unit = "rad"}
torque = {name = "state.s.tau.1", unit = "Nm"}
"""
    )
    log = read_log(path, columns)
    np.testing.assert_allclose(log.position_rad[:, 0], POSITION[:, 1])
    np.testing.assert_allclose(log.torque_nm[:, 0], EFFORT[:, 1])
    with pytest.raises(LogError, match="expected one topic with position and effort"):
        read_log(path)


def nested(k: int) -> dict[str, Any]:
    """Return the state with its names inside, each second message the other way round."""
    inside = {"name": NAMES, **{key: flat(k)[key] for key in FIELDS}}
    turned = {key: values[::-1] for key, values in inside.items()}
    return {"header": flat(k)["header"], "state": turned if k % 2 else inside}


def test_names_inside_an_object_are_those_of_its_arrays(tmp_path: Path):
    arrays = load_arrays(written_json(tmp_path / "run.mcap", {"/arm": messages(nested)}))
    for axis, name in enumerate(NAMES):
        np.testing.assert_array_equal(
            np.asarray(arrays[f"arm.state.effort.{name}"]), EFFORT[:, axis]
        )
    assert "arm.state.effort.0" not in arrays


def test_names_that_are_not_different_are_refused(tmp_path: Path, robot: Robot):
    rows = [(time, {**flat(k), "name": ["elbow", "elbow"]}) for k, time in enumerate(TIME)]
    path = written_json(tmp_path / "run.mcap", {"/arm": rows})
    columns = parse_column_map(
        """[time]
name = "arm.time_s"
[[axis]]
position = {name = "arm.position.elbow", unit = "rad"}
torque = {name = "arm.effort.elbow", unit = "Nm"}
"""
    )
    with pytest.raises(LogError, match="expected names that differ, got 'elbow' twice"):
        read_log(path, columns)


def without(key: str) -> dict[str, Any]:
    return {name: value for name, value in flat(7).items() if name != key}


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (
            '{"name": ["elbow"',
            r"topic /arm: message of 1700000000\.070300 s: expected a whole message",
        ),
        (b"\xff\xfe", r"topic /arm: message of 1700000000\.070300 s: expected a whole message"),
        ("[" * 100_000, r"topic /arm: message of 1700000000\.070300 s: .*nested too deeply"),
        (without("effort"), r"effort\.shoulder.*topic arm.*0\.070000 s.*expected it as in other"),
        (
            {**flat(7), "effort": [1.0, 2.0, 3.0]},
            r"arm: message of 1700000000\.070000 s: effort\.shoulder: expected as many numbers as names, 2, got 3; "
            r"1 of 300",
        ),
        ({**flat(7), "effort": [1.0, None]}, r"effort\.shoulder.*1 NaN.*first at index 7, 0\.07 s"),
        ({**flat(7), "effort": [1.0, float("nan")]}, r"effort\.shoulder.*1 NaN.*index 7, 0\.07 s"),
        (
            {**flat(7), "effort": [1.0, 10**400]},
            r"effort\.shoulder: expected a number, got one with",
        ),
        (
            {**flat(7), "effort": [1.0, "2"]},
            r"topic arm: .*effort\.shoulder: expected it as in other messages, got none",
        ),
    ],
)
def test_what_is_wrong_is_said_by_topic_time_and_field(
    tmp_path: Path, robot: Robot, message: Any, said: str
):
    rows = messages()
    rows[7] = (TIME[7], message)
    path = written_json(tmp_path / "run.mcap", {"/arm": rows})
    with pytest.raises(LogError, match=said):
        read_log(path, robot=robot)


def test_what_is_wrong_elsewhere_does_no_harm(tmp_path: Path, robot: Robot):
    other = [(0.01 * k, {"name": ["a"], "position": [0.0] * (1 + (k == 5))}) for k in range(9)]
    # A picture, and what is nested deeper than any signal.
    deep: Any = 1.0
    for _ in range(30):
        deep = {"in": deep}
    picture = [
        (0.0, {"exposure": 1.0}),
        (0.1, {"data": "x" * 2**21}),
        (0.2, deep),
        (0.3, {"exposure": 2.0}),
    ]
    path = written_json(
        tmp_path / "run.mcap", {"/arm": messages(), "/other": other, "/camera": picture}
    )
    is_the_log(path, robot)
    assert not any(name.startswith("camera") for name in load_arrays(path))
    notes = read_log(path, robot=robot).notes
    assert "left out topic /camera: it has messages of more than 1048576 bytes" in notes


def test_other_encodings_are_refused_by_name(tmp_path: Path, robot: Robot):
    path = written_json(tmp_path / "run.mcap", {"/arm": [(0.0, b"123")]}, encoding="flatbuffer")
    with pytest.raises(
        LogError,
        match="left out topic /arm: expected messages in json, protobuf or cdr, got 'flatbuffer'",
    ):
        read_log(path, robot=robot)
    lying = written_json(tmp_path / "lying.mcap", {"/arm": [(0.0, b"1")]}, encoding="protobuf")
    with pytest.raises(LogError, match="/arm: expected a schema of protobuf with messages"):
        read_log(lying, robot=robot)


def test_a_file_cut_off_is_unreadable(tmp_path: Path, robot: Robot):
    path = written_json(tmp_path / "run.mcap", {"/arm": messages()})
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(LogError, match=r"truncated, corrupt.*file_unreadable"):
        read_log(path, robot=robot)


def test_what_a_file_declares_is_held_against_the_budget(tmp_path: Path, robot: Robot):
    path = written_json(tmp_path / "run.mcap", {"/arm": messages()})
    with pytest.raises(LogError, match="max_bytes"):
        read_log(path, robot=robot, max_bytes=10_000)


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        ("mcap.reader", "MCAP files that are not of ROS"),
        ("mcap_protobuf", "topic /arm: messages in prot"),
    ],
)
def test_libraries_are_named_where_they_are_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str, said: str
):
    def some(name: str):
        if name.startswith(missing):
            raise ImportError(name)
        return import_module(name)

    path = written_protobuf(tmp_path / "run.mcap", "/arm", [(0.0, protobuf_types()["Flat"]())])
    monkeypatch.setattr("axisight.logs.sources_mcap.import_module", some)
    with pytest.raises(MissingExtraError, match=rf"{said}.*axisight\[mcap\]"):
        read_log(path)
