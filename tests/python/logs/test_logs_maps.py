"""Column maps that ship with the package, and patterns for any number of axes."""

import re

import numpy as np
import pytest

from axisight import Robot
from axisight.errors import LogError
from axisight.logs import (
    MAPS,
    ColumnPattern,
    check_log,
    load_column_map,
    named_map_text,
    parse_column_map,
    read_case,
    read_log,
)
from columns_data import GEAR, MAKERS, maker_columns, motion, robot, robot_toml, write_csv

JOINTS = [f"{name}_joint" for name in ("pan", "lift", "elbow", "w1", "w2", "w3", "w4")]


def assert_motion(log, n_axes: int) -> None:
    """The motors of the made-up motion, by the gear ratios."""
    run = motion(n_axes)
    assert log.sample_time_s == pytest.approx(0.004, rel=1e-9)
    np.testing.assert_allclose(log.position_rad, run["position"] / GEAR, rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(log.torque_nm, run["torque"] * GEAR, rtol=1e-6, atol=1e-6)
    if log.velocity_rad_s is not None:
        np.testing.assert_allclose(log.velocity_rad_s, run["velocity"] / GEAR, atol=1e-3)


def test_every_map_is_tried_and_says_where_its_names_come_from():
    assert set(MAPS) == set(MAKERS)
    for name in MAPS:
        assert isinstance(load_column_map(name), ColumnPattern)
        assert named_map_text(name).startswith("# ")


@pytest.mark.parametrize("n_axes", [6, 7])
@pytest.mark.parametrize("maker", MAPS)
def test_a_named_map_reads_what_its_maker_writes(tmp_path, maker, n_axes):
    path = write_csv(tmp_path / "run.csv", maker_columns(maker, n_axes))
    log = read_log(path, maker, robot=robot(n_axes))
    assert log.n_axes == n_axes
    assert_motion(log, n_axes)
    assert (log.velocity_rad_s is None) == (maker == "kuka-rsi")
    assert check_log(path, maker).n_axes == n_axes


@pytest.mark.parametrize(
    ("maker", "renamed"),
    [
        ("franka", {"state.": "", "time": "time"}),
        ("franka", {r"state\.(\w+)\[(\d)\]": r"field.\1\2", "^time$": "%time"}),
        ("kuka-rsi", {r"\.A": "_A"}),
        ("abb", {r"position_J(\d)": r"testsignal_4000_\1", "speed_J": "testsignal_4001_"}),
        (
            "ros-joint-state",
            {r"/joint_states/(\w+)\[(\d)\]": r"field.\1\2", "^__time$": "%time"},
        ),
    ],
)
def test_other_spellings_of_a_maker(tmp_path, maker, renamed):
    columns = maker_columns(maker, 6)
    for old, new in renamed.items():
        columns = {re.sub(old, new, name): values for name, values in columns.items()}
    if "%time" in columns:
        columns["%time"] = np.rint(motion(6)["time"] * 1e9)
    assert_motion(read_log(write_csv(tmp_path / "a.csv", columns), maker, robot=robot(6)), 6)


def test_egm_counts_joints_from_0_and_time_in_ms(tmp_path):
    columns = maker_columns("abb", 6)
    columns["header.tm"] = columns.pop("time") * 1e3
    for k in range(6):
        columns[f"feedBack.joints.joints[{k}]"] = columns.pop(f"position_J{k + 1}")
    assert_motion(read_log(write_csv(tmp_path / "a.csv", columns), "abb", robot=robot(6)), 6)


@pytest.mark.parametrize("separator", [" ", ",", ";", "\t"])
def test_ur_with_any_separator(tmp_path, separator):
    path = write_csv(tmp_path / "a.csv", maker_columns("ur-rtde", 6), separator)
    assert_motion(read_log(path, "ur-rtde", robot=robot(6)), 6)


def test_ur_without_measured_torque_says_what_it_takes(tmp_path):
    columns = maker_columns("ur-rtde", 6)
    columns = {k.replace("actual_current_as_torque", "target_moment"): columns[k] for k in columns}
    path = write_csv(tmp_path / "a.csv", columns)
    log = read_log(path, "ur-rtde", robot=robot(6))
    assert_motion(log, 6)
    assert [note for note in log.notes if "target_moment is what the model" in note]
    said = [f for f in check_log(path, "ur-rtde").findings if "target_moment is" in f.message]
    assert [f.severity for f in said] == ["warning"]
    both = columns | {f"actual_current_as_torque_{k}": columns["timestamp"] for k in range(6)}
    log = read_log(write_csv(tmp_path / "b.csv", both), "ur-rtde", robot=robot(6))
    assert not log.notes
    np.testing.assert_allclose(log.torque_nm[:, 3], columns["timestamp"] * GEAR)


@pytest.mark.parametrize("n_axes", [6, 7])
def test_joints_by_their_names_in_any_order(tmp_path, n_axes):
    names = JOINTS[:n_axes]
    run = motion(n_axes)
    columns = {"__time": run["time"] + 1.7e9}
    for k in np.random.default_rng(0).permutation(n_axes):
        columns[f"/joint_states/{names[k]}/effort"] = run["torque"][:, k]
        columns[f"/joint_states/{names[k]}/position"] = run["position"][:, k]
        columns[f"/joint_states/{names[k]}/velocity"] = run["velocity"][:, k]
    # A gripper that is none of the robot's axes.
    columns["/joint_states/finger/position"] = run["time"]
    path = write_csv(tmp_path / "a.csv", columns)
    assert_motion(read_log(path, "ros-joint-state", robot=robot(n_axes, names)), n_axes)
    assert check_log(path, "ros-joint-state").n_axes == n_axes + 1
    with pytest.raises(LogError, match="like /joint_states/axis1/position or"):
        read_log(path, "ros-joint-state", robot=robot(n_axes))


def test_irregular_stamps_of_ros_are_put_on_a_grid_and_holes_are_not(tmp_path):
    columns = maker_columns("ros-joint-state", 6)
    columns["__time"] += np.random.default_rng(0).uniform(-1e-3, 1e-3, columns["__time"].size)
    path = write_csv(tmp_path / "a.csv", columns)
    log = read_log(path, "ros-joint-state", robot=robot(6))
    assert log.is_resampled
    assert log.sample_rate_hz == pytest.approx(250)
    columns["__time"][700:] += 1.0
    with pytest.raises(LogError, match=r"a\.csv: __time: .* got a hole of 1"):
        read_log(write_csv(path, columns), "ros-joint-state", robot=robot(6))


def test_a_rail_of_the_robot_is_read_in_m(tmp_path):
    text = robot_toml(6).replace('kind = "driven"', 'kind = "driven"\nmotion = "prismatic"', 1)
    path = write_csv(tmp_path / "a.csv", maker_columns("ros-joint-state", 6))
    log = read_log(path, "ros-joint-state", robot=Robot.from_toml(text))
    assert log.axis_kinds == ("prismatic", *["revolute"] * 5)


def test_a_case_by_a_named_map(tmp_path):
    (tmp_path / "robot.toml").write_text(robot_toml(6))
    write_csv(tmp_path / "run.csv", maker_columns("kuka-rsi", 6))
    entry = '[[log]]\nfile = "run.csv"\nrole = "estimation"\n'
    text = f'schema = "axisight.case/1"\nname = "c"\nrobot = "robot.toml"\n{entry}'
    (tmp_path / "case.toml").write_text(text)
    assert_motion(read_case(tmp_path, "kuka-rsi").logs[0], 6)


# What is wrong is said.


def without(columns: dict, *patterns: str) -> dict:
    return {k: v for k, v in columns.items() if not any(re.search(p, k) for p in patterns)}


@pytest.mark.parametrize(
    ("drop", "words"),
    [
        ("actual_q_", "position: expected columns like actual_q_0, got timestamp, some_flag"),
        ("actual_q_2", "expected a column named 'actual_q_2'"),
        ("actual_qd_4", "expected a column named 'actual_qd_4'"),
        ("as_torque_5", "expected a column named 'actual_current_as_torque_5'"),
        ("as_torque", "no column is called actual_current_as_torque_0 or target_moment_0"),
        ("timestamp", "timestamp: expected a column named 'timestamp'"),
    ],
)
def test_missing_columns(tmp_path, drop, words):
    path = write_csv(tmp_path / "a.csv", without(maker_columns("ur-rtde", 6), drop))
    with pytest.raises(LogError, match=re.escape(words)):
        read_log(path, "ur-rtde", robot=robot(6))
    report = check_log(path, "ur-rtde")
    assert not report.ok
    assert any(words in f"{f.column}: {f.message}" for f in report.findings)


@pytest.mark.parametrize(("in_file", "of_robot"), [(6, 7), (7, 6)])
def test_another_number_of_axes(tmp_path, in_file, of_robot):
    path = write_csv(tmp_path / "a.csv", maker_columns("franka", in_file))
    with pytest.raises(LogError, match=f"expected {of_robot} axes, got columns for {in_file}"):
        read_log(path, "franka", robot=robot(of_robot))
    if in_file == 7:  # what a map of one's own may state
        own = parse_column_map("axes = 6\n" + named_map_text("franka"))
        assert_motion(read_log(path, own, robot=robot(6)), 6)


def test_nan_and_a_robot_that_is_missing(tmp_path):
    columns = maker_columns("abb", 6)
    columns["torque_J3"][40] = np.nan
    path = write_csv(tmp_path / "a.csv", columns)
    with pytest.raises(LogError, match="torque_J3: expected finite values, got 1 NaN"):
        read_log(path, "abb", robot=robot(6))
    with pytest.raises(LogError, match="side: expected a robot"):
        read_log(path, "abb")


@pytest.mark.parametrize("name", ["fanuc", "ur_rtde", "UR-RTDE"])
def test_an_unknown_name_lists_those_there_are(tmp_path, name):
    path = write_csv(tmp_path / "a.csv", maker_columns("abb", 6))
    for call in (lambda: read_log(path, name), lambda: named_map_text(name)):
        with pytest.raises(LogError) as caught:
            call()
        assert f"one of {', '.join(MAPS)}" in str(caught.value)


TIME = 'time = { name = "t" }\n'
Q = 'position = { name = "q{0}", unit = "rad" }\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"[every_axis]\n{Q}", "sample_rate_hz"),
        (TIME + '[every_axis]\nposition = { name = "q", unit = "rad" }', "{0}, {1} or {joint}"),
        (TIME + '[every_axis]\nposition = { name = "q{0}{1}", unit = "rad" }', "once in the name"),
        (TIME + "[every_axis]\nposition = []", "position"),
        (TIME + f'[every_axis]\n{Q}torque = {{ name = "i{{0}}", unit = "V" }}', "scale"),
        (TIME + f"axes = 0\n[every_axis]\n{Q}", "axes"),
        (TIME + f"[every_axis]\n{Q}torqe = 1", "every_axis.torqe: expected a known key"),
        (TIME + f"[every_axis]\n{Q}[[axis]]\n", "axis: expected a known key"),
        ('time = { name = "t", resample_hz = "median" }\n[every_axis]\n' + Q, "resample_hz"),
    ],
)
def test_bad_patterns(text, words):
    with pytest.raises(LogError, match=re.escape(words)):
        parse_column_map(text)
