"""Model files with branches: all of them, or those that end at given links."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest
from typer.testing import CliRunner

from axisight import Robot, load_robot
from axisight.cli import app
from axisight.errors import RobotError
from axisight.robot_import import import_robot
from import_data import changed, written
from imported_arms import difference_to_mujoco, difference_to_pinocchio


def link(name: str, mass: float) -> str:
    """Return a link with a mass off its joint."""
    return f"""<link name="{name}"><inertial><origin xyz="0.1 0.05 0.2" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>
    <inertia ixx="0.2" ixy="0.01" ixz="0" iyy="0.3" iyz="-0.02" izz="0.25"/></inertial></link>"""


def joint(name: str, parent: str, child: str, y_m: float, more: str = "") -> str:
    """Return a turning joint."""
    return f"""<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="0.1 {y_m} 0.3" rpy="0.3 0.1 {y_m}"/><axis xyz="0.2 1 {y_m}"/>
    <limit lower="-2" upper="2" effort="80" velocity="3"/>{more}</joint>"""


FOLLOWS = '<mimic joint="left_hand" multiplier="-1"/>'

TWO_ARMS = f"""<robot name="two arms"><link name="ground"/>
{link("torso", 9)}{link("left_upper", 3)}{link("left_lower", 2)}{link("right_upper", 3)}{link("right_lower", 2)}
{link("left_palm", 1)}{link("left_finger", 0.5)}{link("head", 4)}
{joint("waist", "ground", "torso", 0.0)}
{joint("left_shoulder", "torso", "left_upper", 0.3)}{joint("left_elbow", "left_upper", "left_lower", 0.1)}
{joint("right_shoulder", "torso", "right_upper", -0.3)}{joint("right_elbow", "right_upper", "right_lower", -0.1)}
{joint("left_hand", "left_lower", "left_palm", 0.1)}
{joint("finger", "left_lower", "left_finger", 0.2, FOLLOWS)}
<joint name="neck" type="fixed"><parent link="torso"/><child link="head"/><origin xyz="0 0 0.5"/></joint></robot>"""


def test_the_whole_tree_moves_as_in_pinocchio(tmp_path: Path):
    path = written(tmp_path, TWO_ARMS)
    robot = import_robot(path, whole_tree=True)
    arms = ["left_shoulder", "left_elbow", "left_hand", "right_shoulder", "right_elbow"]
    assert robot.joint_names == ["waist", *arms]
    assert [joint.parent for joint in robot.joints] == [None, 0, 1, 2, 0, 4]
    assert not robot.is_chain
    assert "locked at zero, as they follow other joints: finger" in robot.toml
    assert difference_to_pinocchio(robot, pinocchio.buildModelFromUrdf(str(path))) < 1e-12
    # Drive data may ask for it too, and a tip of the call overrules them.
    (tmp_path / "arm.drives.toml").write_text("whole_tree = true\n")
    assert load_robot(path).joint_names == robot.joint_names
    assert import_robot(path, tip="left_palm").is_chain


def test_branches_may_stand_on_the_base(tmp_path: Path):
    path = written(tmp_path, changed(TWO_ARMS, joint("waist", "ground", "torso", 0.0), FIXED_WAIST))
    robot = import_robot(path, whole_tree=True)
    assert [joint.parent for joint in robot.joints] == [None, 0, 1, None, 3]
    assert 'parent = "base"' in robot.toml
    assert difference_to_pinocchio(robot, pinocchio.buildModelFromUrdf(str(path))) < 1e-12


FIXED_WAIST = """<joint name="waist" type="fixed"><parent link="ground"/><child link="torso"/>
<origin xyz="0 0 1" rpy="0.2 0 0.1"/></joint>"""


def test_several_tips_give_several_branches(tmp_path: Path):
    """The hand beyond a tip is locked; so is the whole tree beside the two arms."""
    path = written(tmp_path, TWO_ARMS)
    robot = import_robot(path, tip=["left_lower", "right_lower"])
    arms = ["left_shoulder", "left_elbow", "right_shoulder", "right_elbow"]
    assert robot.joint_names == ["waist", *arms]
    assert "masses carried along: left_hand, finger" in robot.toml
    assert difference_to_pinocchio(robot, pinocchio.buildModelFromUrdf(str(path))) < 1e-12
    one = import_robot(path, tip="left_lower")
    q = np.array([0.3, -0.2, 0.5])
    np.testing.assert_allclose(
        one.gravity(q)[1:], robot.gravity(np.array([*q, 0.1, 0.2]))[1:3], atol=1e-12
    )


def test_an_mjcf_with_two_arms_moves_as_in_mujoco(tmp_path: Path):
    arm = """<body name="{0}" pos="0 {1} 0.4" euler="0.3 0.1 {1}"><joint name="{0}" axis="0 1 1"/>
    <inertial pos="0.1 0 0.2" mass="4" fullinertia="0.2 0.3 0.25 0.01 0 -0.02"/>
    <body name="{0}_hand" pos="0.5 0 0"><joint name="{0}_turn" axis="0 0 -1"/>
    <joint name="{0}_slide" type="slide" axis="1 0 0" pos="0 0.1 0"/>
    <inertial pos="0 0 0.1" mass="2" diaginertia="0.02 0.03 0.025"/></body></body>"""
    text = f"""<mujoco model="two"><compiler angle="radian"/><worldbody>
    <body name="torso"><joint name="waist" axis="0 0 1"/><inertial pos="0 0 0.1" mass="5" diaginertia="1 1 1"/>
    {arm.format("left", 0.3)}{arm.format("right", -0.3)}</body></worldbody></mujoco>"""
    path = written(tmp_path, text, "arm.xml")
    robot = import_robot(path, whole_tree=True)
    assert robot.n_joints == 7
    assert difference_to_mujoco(robot, mujoco.MjModel.from_xml_path(str(path))) < 1e-12


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"whole_tree": True, "tip": "head"}, "whole_tree: expected no tip beside it, got head"),
        ({"tip": ["left_lower", "hand"]}, "--tip: expected a link.*got 'hand'"),
        ({"tip": ["left_finger", "head"]}, "<joint 'finger'>: .*mimics 'left_hand'"),
        ({}, "got 3 moving branches.*whole_tree = true"),
    ],
)
def test_what_cannot_be_a_tree_is_refused(tmp_path: Path, options: dict[str, object], message: str):
    with pytest.raises(RobotError, match=message):
        import_robot(written(tmp_path, TWO_ARMS), **options)  # type: ignore[arg-type]


def test_a_payload_needs_one_last_link(tmp_path: Path):
    path = written(tmp_path, TWO_ARMS)
    (tmp_path / "arm.drives.toml").write_text("whole_tree = true\n[payload]\nmass = 2.0\n")
    with pytest.raises(RobotError, match="payload: expected a robot without branches"):
        import_robot(path)


def test_the_command_line_takes_several_tips(tmp_path: Path):
    path, out = written(tmp_path, TWO_ARMS), tmp_path / "arms.toml"
    tips = ["--tip", "left_palm", "--tip", "right_lower"]
    done = CliRunner().invoke(app, ["robot", "import", str(path), "-o", str(out), *tips])
    assert done.exit_code == 0, done.output
    assert load_robot(out).toml == import_robot(path, tip=["left_palm", "right_lower"]).toml
    one = CliRunner().invoke(app, ["robot", "import", str(path), "--tip", "left_palm"])
    assert Robot.from_toml(one.output).is_chain
    both = CliRunner().invoke(app, ["robot", "import", str(path), "--whole-tree", *tips[:2]])
    assert both.exit_code == 2 and "no --tip beside it, got --tip left_palm" in both.output
