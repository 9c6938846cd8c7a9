"""Limits of joints in robot files and imported models."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import pytest

from axisight import Robot, load_robot
from axisight.errors import InputError, RobotError
from axisight.robot import JointLimits
from import_data import MJCF, URDF, changed, written

PRESETS = resources.files("axisight.robot.presets")
SECOND = (PRESETS / "two_mass_axis.toml").read_text("utf-8")
LIMITS = "[joint.limits]\nposition = [-1, 2.5]\nvelocity = 3\neffort = 80.0\n"
DRIVE = "[joint.drive]\n"


def with_limits(text: str, table: str = LIMITS) -> str:
    assert DRIVE in text
    return text.replace(DRIVE, f"{table}{DRIVE}", 1)


def test_a_robot_file_states_what_its_joints_may_do() -> None:
    robot = Robot.from_toml(with_limits(SECOND))
    stated = JointLimits((-1.0, 2.5), velocity=3.0, effort=80.0)
    assert robot.joint_limits == (stated,)
    assert robot.joint_ranges == ((-1.0, 2.5),)
    # What is changed on a robot leaves them alone; no simulation knows them.
    assert robot.with_operating_point([0.1]).joint_limits == (stated,)
    assert robot.with_effects([]).joint_limits == (stated,)
    assert robot.parameters() == Robot.from_toml(SECOND).parameters()
    assert Robot.from_toml(SECOND).joint_limits == (JointLimits(),)


def test_limits_are_replaced() -> None:
    robot = load_robot("irb6600_like")
    assert robot.joint_limits == (JointLimits(),) * 3
    given = [JointLimits(velocity=float(k)) for k in (1, 2, 3)]
    assert robot.with_joint_limits(given).joint_limits == tuple(given)
    with pytest.raises(InputError, match="limits: expected 3 entries, got 1"):
        robot.with_joint_limits(given[:1])


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("position = [2.5, -1]", "expected the smaller end before the larger [rad], got [2.5, -1]"),
        ("position = [1, 1]", "expected the smaller end before the larger"),
        ("position = [1]", "expected an array of 2 numbers [rad]"),
        ("velocity = 0", "expected a positive number [rad/s], got 0"),
        ("effort = inf", "expected a positive number [Nm]"),
        ("acceleration = 'much'", "expected a positive number [rad/s^2]"),
        ("speed = 1", "unknown key `joint[1].limits.speed`; expected one of position, velocity"),
    ],
)
def test_limits_that_cannot_be_are_refused_with_their_line(table: str, says: str) -> None:
    text = with_limits(SECOND, f"[joint.limits]\n{table}\n")
    line = 1 + text[: text.index(table)].count("\n")
    with pytest.raises(RobotError) as caught:
        Robot.from_toml(text)
    assert says in str(caught.value)
    assert str(caught.value).startswith(f"line {line}: ")


def test_version_one_and_elastic_joints_have_no_limits() -> None:
    arm = (PRESETS / "irb6600_like.toml").read_text("utf-8")
    with pytest.raises(RobotError, match=r"unknown key `joint\[1\].limits`"):
        Robot.from_toml(with_limits(arm))
    arm = arm.replace("axisight.robot/1", "axisight.robot/2", 1)
    # The first elastic joint is a table of its own, which ends where the next joint begins.
    start = arm.index('kind = "elastic"')
    end = arm.find("[[joint]]", start)
    with pytest.raises(RobotError, match="expected no limits, as the joint is elastic"):
        Robot.from_toml(f"{arm[:end]}[joint.limits]\nvelocity = 1\n{arm[end:]}")


def test_an_import_keeps_limits_and_its_robot_file_has_them(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, URDF))
    shoulder, elbow = robot.joint_limits
    assert shoulder == JointLimits((-2.0, 2.0), velocity=3.0, effort=80.0)
    # A continuous joint has no range.
    assert elbow.position is None
    assert Robot.from_toml(robot.toml).joint_limits == robot.joint_limits


@pytest.mark.parametrize("speed", ["0", "inf", "+Infinity", "-1"])
def test_a_speed_that_says_nothing_is_no_limit(tmp_path: Path, speed: str) -> None:
    text = changed(URDF, 'velocity="3"', f'velocity="{speed}"')
    assert load_robot(written(tmp_path, text)).joint_limits[0].velocity is None


def test_pinocchio_states_the_same_limits_as_its_urdf(tmp_path: Path) -> None:
    """Oracle: Pinocchio's own reader of the same file."""
    pinocchio = pytest.importorskip("pinocchio")
    path = written(tmp_path, URDF)
    from axisight.robot_import import import_robot  # noqa: PLC0415 - beside its optional library

    found = import_robot(pinocchio.buildModelFromUrdf(str(path))).joint_limits
    assert found[0] == load_robot(path).joint_limits[0]


FORCES = {
    "motor": ('<motor joint="shoulder" gear="50" ctrlrange="-3 3"/>', 150.0),
    "motor, other gain": (
        '<general joint="shoulder" gear="-50" gainprm="1.6" ctrlrange="-3 3" forcerange="-4 4"/>',
        200.0,
    ),
    "one side smaller": ('<motor joint="shoulder" gear="50" forcerange="-4 2"/>', 100.0),
    "servo": ('<position joint="shoulder" gear="50" kp="9" kv="2" forcerange="-4 4"/>', 200.0),
    "no limit": ('<motor joint="shoulder" gear="50"/>', None),
}


@pytest.mark.parametrize("kind", FORCES)
def test_mjcf_effort_is_what_mujoco_gives_in_both_directions(tmp_path: Path, kind: str) -> None:
    """Oracle: MuJoCo's force at commands far beyond every range."""
    mujoco = pytest.importorskip("mujoco")
    actuator, expected = FORCES[kind]
    path = written(tmp_path, changed(MJCF, MOTOR, actuator), "arm.xml")
    found = load_robot(path).joint_limits[0].effort
    assert found == expected
    if expected is None:
        return
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    forces = []
    for sign in (1.0, -1.0):
        data.ctrl[:] = sign * 1e4
        mujoco.mj_forward(model, data)
        forces.append(abs(float(data.joint("shoulder").qfrc_actuator[0])))
    assert found == pytest.approx(min(forces))


@pytest.mark.parametrize(
    ("actuator", "position", "velocity"),
    [
        ('<position joint="shoulder" gear="50" kp="9" ctrlrange="-20 30"/>', (-0.4, 0.6), None),
        ('<position joint="shoulder" gear="-50" kp="9" ctrlrange="-20 30"/>', (-0.6, 0.4), None),
        ('<velocity joint="shoulder" gear="50" kv="2" ctrlrange="-20 30"/>', None, 0.4),
        (
            '<intvelocity joint="shoulder" gear="50" kp="9" actrange="-9 9" ctrlrange="-5 5"/>',
            None,
            0.1,
        ),
    ],
)
def test_commands_of_an_mjcf_limit_what_they_command(
    tmp_path: Path, actuator: str, position: tuple[float, float] | None, velocity: float | None
) -> None:
    """Closed form: an actuator's length is its gear times the joint's angle."""
    pytest.importorskip("mujoco")
    path = written(tmp_path, changed(MJCF, MOTOR, actuator), "arm.xml")
    found = load_robot(path).joint_limits[0]
    bare = load_robot(written(tmp_path, MJCF, "bare.xml")).joint_limits[0]
    assert found.position == pytest.approx(bare.position if position is None else position)
    assert found.velocity == pytest.approx(velocity)


MOTOR = '<motor joint="shoulder" gear="50"/>'
