"""Targets of positions in column maps that are guessed: taken where the numbers bear them out, else offered."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.errors import LogError
from axisight.logs import parse_column_map, read_log
from axisight.logs.guessing import guess_columns
from columns_data import DEG, GEAR, RATE_HZ, maker_columns, motion, robot, robot_toml, write_csv

JOINTS = ("yaw", "shoulder", "elbow", "wrist")
N = len(JOINTS)
# Samples by which positions come later than their targets.
LATE = 5


def columns(position: str, target: str, **more: np.ndarray) -> dict:
    """Columns by names with the joint at {j}, positions in rad that follow their targets late."""
    q = motion(N)["position"]
    out = {"t": np.arange(len(q) - LATE) / RATE_HZ}
    for k, joint in enumerate(JOINTS):
        out[target.format(j=joint)] = q[LATE:, k]
        out[position.format(j=joint)] = q[:-LATE, k]
        for name, values in more.items():
            out[f"{name}_{joint}"] = values[: len(out["t"]), k]
    return out


def guessed(tmp_path, columns: dict, arm=None):
    return guess_columns(write_csv(tmp_path / "run.csv", columns), arm)


NAMES = [
    ("pos_{j}", "cmd_{j}"),
    ("{j}_position", "{j}_target"),
    ("present_position_{j}", "goal_{j}"),
    ("q_{j}", "q_des_{j}"),
]


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize(("position", "target"), NAMES)
def test_targets_are_read_whatever_they_are_called(tmp_path, position, target, named):
    made = columns(position, target)
    arm = robot(N, list(JOINTS))
    found = guessed(tmp_path, made, arm if named else None)
    assert found.missing is None
    log = read_log(tmp_path / "run.csv", found.columns, robot=arm)
    q = motion(N)["position"] / GEAR
    np.testing.assert_allclose(log.position_ref_rad, q[LATE:], atol=1e-4)
    np.testing.assert_allclose(log.position_rad, q[:-LATE], atol=1e-4)
    said = any("no name says of what it is a target" in doubt for doubt in found.doubts)
    assert said is ("q_" not in target)


def test_what_says_that_it_is_a_target_of_positions_comes_first(tmp_path):
    made = columns("pos_{j}", "pos_cmd_{j}", set=motion(N)["position"])
    found = guessed(tmp_path, made)
    assert found.columns.axis[0].position_ref.name == "pos_cmd_yaw"
    assert "beside one of positions" in found.unused["set_yaw and 3 like it"]


def test_targets_of_something_else_are_offered_and_the_map_is_not_complete(tmp_path):
    """Targets of speeds, whose name does not say so: positions do not follow them."""
    made = columns("pos_{j}", "x_{j}", cmd=motion(N)["velocity"])
    found = guessed(tmp_path, made)
    assert all(axis.position_ref is None for axis in found.columns.axis)
    why = found.unused["cmd_yaw and 3 like it"]
    assert why == "a target, no name says of what, that positions do not follow in their unit"
    assert found.text.count("# position_ref = { name = ") == N
    assert found.missing is not None
    assert "position_ref, if these are targets of the positions" in found.missing
    with pytest.raises(LogError, match="expected a torque"):
        read_log(tmp_path / "run.csv", found.columns, robot=robot(N))
    done = found.text.replace("# position_ref = {", "position_ref = {")
    log = read_log(tmp_path / "run.csv", parse_column_map(done, "done"), robot=robot(N))
    assert log.position_ref_rad is not None


@pytest.mark.parametrize("other", ["vel", "torque", "current"])
def test_what_two_quantities_follow_is_left_to_a_person(tmp_path, other):
    made = columns("pos_{j}", "cmd_{j}", **{other: motion(N)["position"]})
    found = guessed(tmp_path, made)
    assert all(axis.position_ref is None for axis in found.columns.axis)
    assert "so does " in found.unused["cmd_yaw and 3 like it"]
    # With a torque a map is complete; without one it has the line.
    offered = '# position_ref = { name = "cmd_yaw", unit = "rad" }' in found.text
    assert offered is (other != "torque")
    assert (found.missing is None) is (other == "torque")


def test_two_that_positions_follow_are_a_choice(tmp_path):
    made = columns("pos_{j}", "cmd_{j}", goal=motion(N)["position"])
    found = guessed(tmp_path, made)
    assert any(re.match("position_ref: left out, for it could be", d) for d in found.doubts)
    for name in ("cmd_yaw", "goal_yaw"):
        assert f'# position_ref = {{ name = "{name}", unit = "rad" }}' in found.text


def test_the_unit_in_the_name_of_a_target_is_in_its_line(tmp_path):
    made = columns("pos_{j}_rad", "x_{j}")
    made |= {f"cmd_{j}_deg": made[f"x_{j}"] * DEG for j in JOINTS}
    # Positions in rad follow it.
    assert '\nposition_ref = { name = "cmd_yaw_deg", unit = "deg" }' in guessed(tmp_path, made).text
    made |= {f"cmd_{j}_deg": np.cos(np.arange(made["t"].size)) for j in JOINTS}
    assert '# position_ref = { name = "cmd_yaw_deg", unit = "deg" }' in guessed(tmp_path, made).text


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"i": motion(N)["torque"]}, r'Nm \(or N\) per A in place of .* \("unknown" where'),
        ({"tau": motion(N)["torque"], "torque": motion(N)["torque"]}, "one torque of every axis"),
        ({"vel": motion(N)["velocity"]}, "add a torque, or a position_ref, of every axis"),
    ],
)
def test_the_last_line_says_what_has_to_be_filled_in(tmp_path, more, words):
    path = write_csv(tmp_path / "run.csv", columns("pos_{j}", "x_{j}", **more))
    (tmp_path / "robot.toml").write_text(robot_toml(N, list(JOINTS)))
    out = tmp_path / "columns.toml"
    said = ["columns", "guess", path, "--robot", tmp_path / "robot.toml", "-o", out]
    result = CliRunner().invoke(app, [*map(str, said)])
    assert result.exit_code == 0, result.output
    last = "then: " + " ".join(result.output.split("then: ")[1].split())
    assert re.match(rf"then: complete the map \(.*{words}.*\), and run axisight check", last)
    assert re.search(f"^# not complete yet: .*{words}", out.read_text(), re.MULTILINE)


def test_a_map_of_a_maker_without_its_torque_is_named(tmp_path):
    made = maker_columns("ur-rtde", 6)
    made = {n.replace("actual_current_as_torque", "actual_current"): v for n, v in made.items()}
    found = guessed(tmp_path, made, robot(6))
    words = "the names are those of ur-rtde, but no column is called actual_current_as_torque_0 or"
    assert any(doubt.startswith(words) for doubt in found.doubts)
    with pytest.raises(LogError, match='as a comment, currents with a scale to be stated, or "unk'):
        read_log(tmp_path / "run.csv", found.columns, robot=robot(6))


def test_native_targets_need_no_map(tmp_path):
    time = motion(N)["time"]
    made = {"time_s": time, "position_1": time, "position_ref_1": time}
    with pytest.raises(LogError, match="it needs no map"):
        guessed(tmp_path, made)
