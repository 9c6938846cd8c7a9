"""Rotors by class of robot: said aloud, of the size of known machines, and with a wide tolerance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_rotor_inertia import STEP_S, logs_of
from typer.testing import CliRunner

from axisight import Robot, diagnose, load_robot
from axisight.cli import app
from axisight.errors import RobotError
from axisight.robot_import import import_robot
from axisight.robot_import.classes import TOLERANCE, effort_range_nm, rotor_inertia
from axisight.robot_import.drives import DriveData
from import_data import MJCF, URDF, changed, written

LIMITED = changed(
    URDF, '<axis xyz="0 0 -1"/>', '<axis xyz="0 0 -1"/><limit effort="30" velocity="3"/>'
)


def of_class(kind: str, **more: object) -> DriveData:
    return DriveData.model_validate({"class": kind, **more})


def reflected(robot: Robot) -> list[float]:
    drives = [joint.drive for joint in robot.joints]
    return [d.motor_inertia / d.gear_ratio**2 for d in drives if d is not None]


@pytest.mark.parametrize(
    ("kind", "effort_nm", "inertia"),
    [
        ("cobot", 87.0, 0.606),
        ("cobot", 87.0, 0.462),
        ("cobot", 12.0, 0.206),
        ("industrial", 97.6, 0.784),
        ("industrial", 186.4, 2.325),
        ("industrial", 21.3, 0.194),
        ("desktop", 10.0, 0.0266),
        ("desktop", 7.3, 0.0120),
        ("desktop", 0.52, 0.00199),
    ],
)
def test_known_machines_are_within_the_tolerance(kind, effort_nm, inertia):
    assert abs(rotor_inertia(kind, effort_nm) / inertia - 1) < TOLERANCE
    low, high = effort_range_nm(kind)
    assert low < effort_nm < high


def test_what_nothing_says_is_filled_and_said(tmp_path: Path):
    path = written(tmp_path, LIMITED)
    robot = import_robot(path, drives=of_class("cobot"))
    expected = [rotor_inertia("cobot", effort) for effort in (80.0, 30.0)]
    np.testing.assert_allclose(reflected(robot), expected)
    assert robot.tolerances == {"motor_inertia": TOLERANCE}
    (tmp_path / "arm.drives.toml").write_text('class = "cobot"\n')
    out = tmp_path / "robot.toml"
    done = CliRunner().invoke(app, ["robot", "import", str(path), "-o", str(out)])
    assert "class cobot: rotors of typical machines by effort limits" in done.output
    assert f"shoulder {expected[0]:.2g} kg m^2, elbow {expected[1]:.2g} kg m^2" in done.output
    np.testing.assert_allclose(reflected(load_robot(out)), expected)


def test_what_is_stated_stays(tmp_path: Path):
    path = written(tmp_path, LIMITED)
    stated = of_class(
        "cobot",
        tolerances={"motor_inertia": 0.1},
        joint={"shoulder": {"motor_inertia": 1e-4}, "elbow": {"gear_ratio": 0.01}},
    )
    robot = import_robot(path, drives=stated)
    shoulder, elbow = (joint.drive for joint in robot.joints)
    assert shoulder is not None
    assert elbow is not None
    assert shoulder.motor_inertia == 1e-4
    assert elbow.gear_ratio == 0.01
    assert elbow.motor_inertia == pytest.approx(rotor_inertia("cobot", 30.0) * 1e-4)
    assert robot.tolerances == {"motor_inertia": 0.1}
    mjcf = import_robot(written(tmp_path, MJCF, "arm.xml"))
    same = import_robot(tmp_path / "arm.xml", drives=of_class("cobot"))
    assert reflected(same)[0] == reflected(mjcf)[0] > 0


@pytest.mark.parametrize("effort", ["0", "1000"])
def test_a_limit_that_is_none_fills_nothing(tmp_path: Path, effort: str):
    text = changed(URDF, 'effort="80"', f'effort="{effort}"')
    robot = import_robot(written(tmp_path, text), drives=of_class("cobot"))
    assert reflected(robot) == [0.0, 0.0]
    assert not robot.tolerances
    for name, got in (("shoulder", effort), ("elbow", "0")):
        expected = "expected a joint that turns, with an effort limit of 3 to 348 Nm"
        assert f"no rotor for {name}: {expected}, got revolute and {got}" in robot.toml


def test_an_unknown_class_is_refused(tmp_path: Path):
    drives = written(tmp_path, 'class = "crane"\n', "my.toml")
    with pytest.raises(RobotError, match="class: Input should be 'cobot', 'industrial'"):
        import_robot(written(tmp_path, URDF), drives=drives)


def test_a_rotor_that_is_off_is_refitted_and_no_cause(tmp_path: Path):
    """Half as heavy as the class says: within the tolerance, where a missing one is a cause."""
    bare = LIMITED.replace('<dynamics damping="0.7" friction="1.5"/>', "")
    text = bare[: bare.index("  <transmission")] + "</robot>"
    path = written(tmp_path, text)
    plain = import_robot(path, sample_time_s=STEP_S)
    robot = import_robot(path, drives=of_class("cobot"), sample_time_s=STEP_S)
    logs = logs_of(plain, 0.5 * np.array(reflected(robot)))
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "none"
    for axis in (1, 2):
        name = robot.axis_parameter(axis, "motor_inertia")
        assert name is not None
        assert found.refit[name].value == pytest.approx(-0.5, abs=0.03)
