"""Causes written into models: the numbers that change, and not a byte beside them."""

from __future__ import annotations

import difflib
from pathlib import Path

import pytest

from axisight import load_robot
from axisight.errors import InputError
from axisight.gap.result import Cause, Interval
from axisight.write_back import write_model
from import_data import MJCF, URDF, changed, written

UNITS = {"coulomb_nm": "Nm", "viscous_nm_s_rad": "Nm s/rad", "half_width_rad": "rad"}


def cause(effect: str, axis: int, name: str, value: float) -> Cause:
    interval = Interval(value, 0.9 * value, 1.1 * value)
    return Cause(effect, axis, 0.97, {name: interval}, UNITS, Interval(50.0, 40.0, 60.0))


DRY, VISCOUS = (
    cause("coulomb_friction", 1, "coulomb_nm", 0.05),
    cause("viscous_friction", 2, "viscous_nm_s_rad", 0.3),
)
PLAY = cause("backlash", 1, "half_width_rad", 1e-4)


def lines_changed(before: Path, after: Path) -> list[str]:
    """Return the lines that are not in both, with their signs."""
    texts = [path.read_text().splitlines() for path in (before, after)]
    found = difflib.unified_diff(*texts, n=0, lineterm="")
    return [line for line in found if not line.startswith(("---", "+++", "@@"))]


def test_friction_stands_in_a_urdf(tmp_path: Path):
    """One joint has <dynamics>, the other gets it; the shoulder's gear is fifty."""
    source = written(tmp_path, URDF)
    robot = load_robot(source)
    made = write_model(source, robot, [DRY, VISCOUS, PLAY], tmp_path / "new.urdf")
    assert made.placed == ("coulomb_friction@1", "viscous_friction@2")
    assert made.left_out == ("backlash@1",)
    assert lines_changed(source, made.path) == [
        '-    <dynamics damping="0.7" friction="1.5"/>',
        "+    <!-- axisight: coulomb_friction@1: coulomb_nm = 0.05 (0.045 to 0.055) Nm on the motor, "
        "probability 0.97 -->",
        '+    <dynamics damping="0.7" friction="2.5"/>',
        "+    <!-- axisight: viscous_friction@2: viscous_nm_s_rad = 0.3 (0.27 to 0.33) Nm s/rad on the motor, "
        "probability 0.97 -->",
        '+    <dynamics damping="0.3"/>',
    ]
    again = load_robot(made.path)
    assert again.effects[0].values()[0] == pytest.approx(0.05)
    assert again.parameters()["elbow.viscous_friction"] == pytest.approx(0.3)
    rest = {n: v for n, v in robot.parameters().items() if n != "elbow.viscous_friction"}
    assert {n: again.parameters()[n] for n in rest} == rest


def test_both_frictions_of_a_joint_are_one_change(tmp_path: Path):
    source = written(tmp_path, URDF)
    both = [DRY, cause("viscous_friction", 1, "viscous_nm_s_rad", 1e-4)]
    made = write_model(source, load_robot(source), both, tmp_path / "new.urdf")
    again = load_robot(made.path)
    # What is found comes on top of the viscous friction that the simulator has.
    assert again.parameters()["shoulder.viscous_friction"] == pytest.approx(0.7 / 50**2 + 1e-4)
    assert again.effects[0].values()[0] == pytest.approx(0.05)
    assert made.path.read_text().count("axisight:") == 1


def test_an_element_without_content_gets_one(tmp_path: Path):
    """MJCF has numbers as attributes; quotes, order and line breaks of others stay."""
    source = written(tmp_path, changed(MJCF, 'name="elbow"', "name='elbow'"), "arm.xml")
    robot = load_robot(source)
    made = write_model(source, robot, [DRY, VISCOUS], tmp_path / "new.xml")
    assert lines_changed(source, made.path) == [
        "+      <!-- axisight: coulomb_friction@1: coulomb_nm = 0.05 (0.045 to 0.055) Nm on the motor, "
        "probability 0.97 -->",
        '-             frictionloss="1.5" armature="0.2" stiffness="3"/>',
        '+             frictionloss="2.5" armature="0.2" stiffness="3"/>',
        "-        <joint name='elbow' axis=\"0 0 -1\"/>",
        "+        <!-- axisight: viscous_friction@2: viscous_nm_s_rad = 0.3 (0.27 to 0.33) Nm s/rad on the motor, "
        "probability 0.97 -->",
        '+        <joint name=\'elbow\' axis="0 0 -1" damping="0.3"/>',
    ]
    assert load_robot(made.path).parameters()["elbow.viscous_friction"] == pytest.approx(0.3)


def test_a_robot_file_has_place_for_all(tmp_path: Path):
    source = written(tmp_path, URDF)
    robot = load_robot("irb6600_like")
    made = write_model("irb6600_like", robot, [DRY, VISCOUS, PLAY], tmp_path / "new.toml")
    assert made.left_out == ()
    labels = [effect.label for effect in load_robot(made.path).effects]
    assert sorted(labels) == ["backlash@1", "coulomb_friction@1", "viscous_friction@2"]
    urdf = write_model(source, load_robot(source), [DRY], tmp_path / "of_urdf.toml")
    assert load_robot(urdf.path).effects[0].values()[0] == pytest.approx(0.05)


def test_misuse_is_named(tmp_path: Path):
    source = written(tmp_path, URDF)
    robot = load_robot(source)
    with pytest.raises(InputError, match=r"expected \.urdf as the model.*'\.xml'"):
        write_model(source, robot, [DRY], tmp_path / "new.xml")
    with pytest.raises(InputError, match="exists"):
        write_model(source, robot, [DRY], source)
    with pytest.raises(InputError, match=r"expected \.toml as the model"):
        write_model("irb6600_like", robot, [DRY], tmp_path / "new.urdf")
    with pytest.raises(InputError, match=r"got '\.csv'"):
        write_model("arm.csv", robot, [DRY], tmp_path / "new.csv")
