"""Accelerometers in robot files, and on robots."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from axisight import InputError, Robot, RobotError, load_robot
from axisight.robot import Accelerometer
from axisight.robot_file import Provenance, identified, write_identified

PRESET = load_robot("irb6600_like")
BLOCK = """
[[accelerometer]]
name = "elbow"
joint = "axis2_yaw"
position = [0.0, 0.1, 1.0]
directions = [[0.0, 0.6, 0.8]]
[[accelerometer]]
name = "tip"
joint = "axis3_yaw"
position = [1.2, 0.1, 0.2]
"""
TEXT = PRESET.toml.replace("axisight.robot/1", "axisight.robot/2") + BLOCK
ELBOW = Accelerometer("elbow", "axis2_yaw", (0.0, 0.1, 1.0), ((0.0, 0.6, 0.8),))
TIP = Accelerometer("tip", "axis3_yaw", (1.2, 0.1, 0.2))


def test_a_file_states_them() -> None:
    assert Robot.from_toml(TEXT).accelerometers == (ELBOW, TIP)
    assert PRESET.accelerometers == ()
    assert ELBOW.readings == ("elbow_x",)
    assert TIP.readings == ("tip_x", "tip_y", "tip_z")


def test_a_robot_gets_others_and_keeps_the_rest() -> None:
    changed = PRESET.with_parameters({"axis2.stiffness": 2e6}).with_operating_point([0.1, 0.2, 0.3])
    found = changed.with_accelerometers([TIP])
    assert found.accelerometers == (TIP,)
    assert found.parameters() == changed.parameters()
    np.testing.assert_array_equal(found.operating_point, changed.operating_point)
    assert found.with_accelerometers([ELBOW]).accelerometers == (ELBOW,)
    assert found.with_accelerometers([]).accelerometers == ()
    assert Robot.from_toml(found.toml).accelerometers == (TIP,)


def test_other_changes_and_pickles_keep_them() -> None:
    robot = Robot.from_toml(TEXT)
    for other in (
        robot.with_parameters({"axis2.stiffness": 2e6}),
        robot.with_sample_time(1e-3),
        robot.with_effects([]),
        robot.with_controller_speed(0.5),
        Robot(pickle.loads(pickle.dumps(robot.core))),
    ):
        assert other.accelerometers == (ELBOW, TIP)


def test_a_written_robot_keeps_them(tmp_path) -> None:
    path = tmp_path / "arm.toml"
    found = identified({"axis2.stiffness": 3.9e6}, Provenance("test"))
    write_identified(PRESET.with_accelerometers([ELBOW, TIP]), path, found)
    robot = load_robot(path)
    assert robot.accelerometers == (ELBOW, TIP)
    assert robot.parameters()["axis2.stiffness"] == 3.9e6


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("axisight.robot/2", "axisight.robot/1", "unknown key `accelerometer`; expected one of"),
        ('name = "tip"', 'name = "tip"\nplace = "wrist"', "accelerometer.2..place"),
        ('name = "tip"', 'name = "elbow"', "a name that no other .*accelerometer"),
        ('name = "tip"', 'name = "at the tip"', "letters, digits and underscores"),
        ('joint = "axis3_yaw"', 'joint = "axis4"', "the name of a joint, one of axis1"),
        ('joint = "axis3_yaw"', "joint = 3", "the name of a joint, one of axis1"),
        ("[0.0, 0.6, 0.8]", "[0.0, 0.6, 0.7]", "a unit vector of 3 numbers"),
        ("[[0.0, 0.6, 0.8]]", "[]", "one to three unit vectors"),
        ("[1.2, 0.1, 0.2]", "[1.2, 0.1]", "an array of 3 numbers .m."),
    ],
)
def test_a_faulty_file_is_refused(old: str, new: str, message: str) -> None:
    assert old in TEXT
    with pytest.raises(RobotError, match=message):
        Robot.from_toml(TEXT.replace(old, new))


def test_misuse() -> None:
    with pytest.raises(InputError, match="name: expected letters, digits and underscores"):
        Accelerometer("2nd", "axis1", (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="position_m: expected three numbers, got 2"):
        Accelerometer("a", "axis1", (0.0, 0.0))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="directions: expected one to three unit vectors"):
        Accelerometer("a", "axis1", (0.0, 0.0, 0.0), ((2.0, 0.0, 0.0),))
    with pytest.raises(RobotError, match="the name of a joint"):
        PRESET.with_accelerometers([Accelerometer("a", "axis9", (0.0, 0.0, 0.0))])
    with pytest.raises(RobotError, match=r"no other .*accelerometer"):
        PRESET.with_accelerometers([TIP, TIP])
    with pytest.raises(InputError, match=r"q: expected shape \(7,\)"):
        PRESET.with_accelerometers([TIP]).specific_force(np.zeros(6), np.zeros(7), np.zeros(7))


def test_specific_force_of_one_and_of_many() -> None:
    robot = Robot.from_toml(TEXT)
    many = robot.specific_force(np.ones((4, 7)), np.ones((4, 7)), np.ones((4, 7)))
    assert many.shape == (4, 2, 3)
    one = robot.specific_force(np.ones(7), np.ones(7), np.ones(7))
    np.testing.assert_array_equal(many[2], one)
    assert np.isnan(one[0, 1:]).all()
    np.testing.assert_array_equal(
        PRESET.specific_force(np.ones(7), np.ones(7), np.ones(7)), np.zeros((0, 3))
    )
