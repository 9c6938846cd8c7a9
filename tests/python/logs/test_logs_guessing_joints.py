"""Joints of the robot in the names of columns of which a map is guessed."""

import re

import numpy as np
import pytest

from axisight.errors import LogError
from axisight.logs import read_log
from axisight.logs.guessing import guess_columns
from axisight.logs.guessing.names import joint_in
from columns_data import GEAR, motion, robot, write_csv

# As a UR has them, in the order of the arm, which is not that of the columns below.
JOINTS = [
    f"{name}_joint"
    for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
]
N = len(JOINTS)


def short(joint: str) -> str:
    return joint.removesuffix("_joint")


def columns(position: str, torque: str = "", call=lambda joint: joint) -> dict:
    """Columns by names with what a joint is called at {}, in the order of the letters."""
    run = motion(N)
    out = {"t": run["time"]}
    for k in sorted(range(N), key=JOINTS.__getitem__):
        out[position.format(call(JOINTS[k]))] = run["position"][:, k]
        if torque:
            out[torque.format(call(JOINTS[k]))] = run["torque"][:, k]
    return out


@pytest.mark.parametrize(
    "call",
    [
        lambda joint: joint,
        short,
        lambda joint: short(joint).title(),
        str.upper,
    ],
)
def test_joints_are_known_without_joint_and_in_other_letters(tmp_path, call):
    arm = robot(N, JOINTS)
    path = write_csv(tmp_path / "run.csv", columns("{}_angle", "{}_effort", call))
    log = read_log(path, guess_columns(path, arm).columns, robot=arm)
    run = motion(N)
    np.testing.assert_allclose(log.position_rad, run["position"] / GEAR, atol=1e-4)
    np.testing.assert_allclose(log.torque_nm, run["torque"] * GEAR, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "joint"),
    [
        ("elbow_pos", "elbow_joint"),
        ("pos.Joint_Wrist", "joint_wrist"),
        ("wrist[rad]", "joint_wrist"),
        # A longer name is no shorter one.
        ("shoulder_pan_pos", "shoulder_pan_joint"),
        ("shoulder_pos", "shoulder_joint"),
        ("elbows_pos", None),
        # As it is written comes first, and what two share is none.
        ("tool_pos", "tool"),
        ("Tool_pos", None),
        # The rest of a name stands for nothing alone.
        ("q_1", None),
        ("q_b", None),
        ("joint_1_q", "joint_1"),
    ],
)
def test_which_joint_a_name_means(name, joint):
    joints = ["shoulder_joint", "shoulder_pan_joint", "elbow_joint", "joint_wrist"]
    joints += ["tool", "tool_joint", "joint_1", "joint_b"]
    found = joint_in(name, joints)
    assert (None if found is None else found[0]) == joint


def test_joints_without_a_column_are_named(tmp_path):
    made = columns("{}_angle", "{}_effort", short)
    made = {name: v for name, v in made.items() if name not in ("elbow_angle", "wrist_2_angle")}
    path = write_csv(tmp_path / "run.csv", made)
    words = "expected positions of 6 axes, got columns for 4: no position is called after "
    with pytest.raises(LogError, match=re.escape(f"{words}elbow_joint, wrist_2_joint; columns:")):
        guess_columns(path, robot(N, JOINTS))
    # Where no column has the name of a joint there is none to be named.
    with pytest.raises(LogError, match=r"expected positions of 6 axes, got columns for \d; col"):
        guess_columns(path, robot(N, [f"axis_{c}" for c in "abcdef"]))


@pytest.mark.parametrize("word", ["meas", "measured", "actual", "present", "fb"])
def test_what_is_measured_of_joints_and_nothing_else_is_a_position(tmp_path, word):
    made = columns(f"{word}_{{}}", "", short)
    made |= {name.replace(word, "cmd"): values for name, values in made.items() if name != "t"}
    arm = robot(N, JOINTS)
    found = guess_columns(write_csv(tmp_path / "run.csv", made), arm)
    assert found.missing is None
    (doubt,) = [d for d in found.doubts if "no name says of what: proposed, check" in d]
    assert f"# doubtful: {doubt}" in found.text
    log = read_log(tmp_path / "run.csv", found.columns, robot=arm)
    for got in (log.position_rad, log.position_ref_rad):
        np.testing.assert_allclose(got, motion(N)["position"] / GEAR, atol=1e-4)


def test_what_is_measured_is_no_position_beside_one_or_of_fewer_joints(tmp_path):
    arm = robot(N, JOINTS)
    made = columns("meas_{}", "", short)
    beside = made | columns("q_{}", "", short)
    found = guess_columns(write_csv(tmp_path / "run.csv", beside), arm)
    assert found.columns.axis[0].position.name == "q_shoulder_pan"
    fewer = {name: values for name, values in made.items() if name != "meas_elbow"}
    two = made | columns("actual_{}", "", short)
    foreign = {name if name == "t" else f"{name}_nm": values for name, values in made.items()}
    for given in (fewer, two, foreign):
        with pytest.raises(LogError, match="position: expected columns whose names say so"):
            guess_columns(write_csv(tmp_path / "run.csv", given), arm)
    with pytest.raises(
        LogError, match="and --robot says whether joints are called as in meas_elbow"
    ):
        guess_columns(write_csv(tmp_path / "run.csv", made))
