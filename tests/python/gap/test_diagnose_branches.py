"""Diagnoses of a robot with two arms, by inverse dynamics."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight import Diagnosis, Log, Robot, Settings, diagnose, effect_table
from axisight.gap import check_inputs
from axisight.robot.branches import carriers, neighbouring_axes, tips

STEP_S, SECONDS = 4e-3, 12.0
LEFT_LOWER, RIGHT_UPPER = 2, 3
RATIO, ROTOR, VISCOUS = 0.01, 1e-4, 1e-3


def joint(name: str, parent: str, origin: str, axis: str, mass: float) -> str:
    return f"""
[[joint]]
name = "{name}"
parent = "{parent}"
kind = "driven"
origin = {origin}
axis = {axis}
[joint.link]
mass = {mass}
com = [0.02, 0.03, -0.15]
inertia = [0.04, 0.05, 0.03, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = {RATIO}
motor_inertia = {ROTOR}
viscous_friction = {VISCOUS}
"""


@pytest.fixture(scope="module")
def two_arms() -> Robot:
    """A waist about the vertical, and an arm of two joints on either side."""
    head = 'schema = "axisight.robot/2"\nname = "two arms"\ngravity = [0.0, 0.0, -9.81]\nsample_time = 4e-3\n'
    lower = "[0.0, 0.0, -0.3]"
    return Robot.from_toml(
        head
        + joint("waist", "base", "[0.0, 0.0, 0.5]", "[0.0, 0.0, 1.0]", 8.0)
        + joint("left_upper", "waist", "[0.0, 0.25, 0.3]", "[0.0, 1.0, 0.0]", 3.0)
        + joint("left_lower", "left_upper", lower, "[0.0, 1.0, 0.0]", 2.0)
        + joint("right_upper", "waist", "[0.0, -0.25, 0.3]", "[0.0, 1.0, 0.0]", 3.0)
        + joint("right_lower", "right_upper", lower, "[1.0, 0.0, 0.0]", 2.0)
    )


def log_of(
    robot: Robot, run: int, *, dry_nm: float = 0.0, heavier: float = 1.0, link: str = "left_lower"
) -> Log:
    """Return a log of motors with dry friction on axis 4 and a heavier ``link``."""
    t = STEP_S * np.arange(round(SECONDS / STEP_S))
    axis = np.arange(robot.n_axes)
    q, v, a = np.zeros((3, len(t), robot.n_axes))
    for size, rate in ((0.4, 1.1 + 0.2 * run), (0.2, 2.7 + 0.3 * run)):
        w = rate * (1 + 0.07 * axis)
        at = w * t[:, None] + 1.3 * axis + run
        q, v, a = (
            q + size * np.sin(at),
            v + size * w * np.cos(at),
            a - size * w**2 * np.sin(at),
        )
    name = f"{link}.mass"
    machine = robot.with_parameters({name: robot.parameters()[name] * heavier})
    motor = RATIO * machine.inverse_dynamics(q, v, a) + (ROTOR * a + VISCOUS * v) / RATIO
    if dry_nm:
        motor[:, RIGHT_UPPER] += dry_nm * np.tanh(v[:, RIGHT_UPPER] / RATIO / 0.5)
    random = np.random.default_rng(run)
    return Log(
        name=f"run{run}",
        source=Path(f"run{run}"),
        sample_time_s=STEP_S,
        time_s=t,
        position_rad=q / RATIO + 1e-4 * random.normal(size=q.shape),
        torque_nm=motor + 5e-4 * random.normal(size=q.shape),
    )


def diagnosed(robot: Robot, **of: Any) -> Diagnosis:
    logs = [log_of(robot, run, **of) for run in range(3)]
    return diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], settings=Settings(bootstrap=100)
    )


def test_friction_of_one_arm_is_named_there(two_arms: Robot):
    found = diagnosed(two_arms, dry_nm=0.03)
    assert [cause.label for cause in found.causes] == [f"coulomb_friction@{RIGHT_UPPER + 1}"]
    assert found.verdict == "explained"
    value = found.causes[0].parameters["coulomb_nm"]
    assert value.low <= 0.03 <= value.high
    assert not {"payload", "link_geometry"} & {entry.effect for entry in found.ranking}


def test_a_heavier_link_is_named_on_its_arm(two_arms: Robot):
    found = diagnosed(two_arms, heavier=1.3)
    assert found.causes[0].label == f"link_mass@{LEFT_LOWER + 1}"


def test_nothing_is_named_where_nothing_is_missing(two_arms: Robot):
    assert diagnosed(two_arms).verdict == "none"


def test_logs_of_a_tree_are_checked(two_arms: Robot):
    found = check_inputs(two_arms, [log_of(two_arms, 0)], [log_of(two_arms, 1)])
    assert not [f for f in found if f.severity == "refuse"]


def test_links_are_felt_from_the_base_to_them(two_arms: Robot):
    assert carriers(two_arms) == {1: (1,), 2: (1, 2), 3: (1, 2, 3), 4: (1, 4), 5: (1, 4, 5)}
    assert tips(two_arms) == [3, 5]
    assert neighbouring_axes(two_arms) == [(1, 2), (2, 3), (1, 4), (4, 5)]


def test_only_effects_at_a_tip_or_next_joint_need_a_chain():
    assert {i.name for i in effect_table().values() if i.needs_chain} == {
        "payload",
        "link_geometry",
    }
