"""Joint encoders that contradict their motors are set aside, each by the name of its fault."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Log, Robot, load_robot, simulate
from axisight.gap.prepare.joint_encoders import without_unlike_encoders

GEARS = [
    (),
    (Effect("backlash", 1, {"half_width_rad": 0.004, "damped": 1.0}),),
    (Effect("joint_stiffness", 1, {"relative_change": -0.7}),),
]


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("irb6600_like")


@pytest.fixture(scope="module", params=GEARS, ids=["stiff", "play", "soft"])
def swing(robot: Robot, request: pytest.FixtureRequest) -> Log:
    """Return a log of swings of the first axis, whose machine has another gear."""
    time = robot.sample_time_s * np.arange(int(8.0 / robot.sample_time_s))
    speed = np.zeros((len(time), robot.n_axes))
    speed[:, 0] = 60 * np.sin(2 * np.pi * 0.5 * time)
    run = simulate(robot, speed, effects=request.param)
    return Log(
        name="swings",
        source=Path("simulation"),
        time_s=time,
        sample_time_s=robot.sample_time_s,
        position_rad=run["position_rad"].to_numpy(),
        torque_nm=run["torque_cmd_nm"].to_numpy(),
        velocity_ref_rad_s=speed,
        joint_position_rad=run["joint_position_rad"].to_numpy()[:, robot.axis_joints],
    )


def changed(log: Log, factor: float, offset_rad: float = 0.0) -> Log:
    joint = np.array(log.joint_position_rad)
    joint[:, 0] = factor * joint[:, 0] + offset_rad
    return replace(log, joint_position_rad=joint)


@pytest.mark.parametrize("offset_rad", [0.0, 0.3])
def test_other_gears_and_zeros_stay(robot: Robot, swing: Log, offset_rad: float) -> None:
    logs, found = without_unlike_encoders(robot, [changed(swing, 1.0, offset_rad)])
    assert found == ()
    assert logs[0].joint_position_rad is not None
    assert np.isfinite(logs[0].joint_position_rad).all()


# A play of 4 mrad moves the slope of swings of 95 mrad by a tenth, so that only the stiff gear shows the exact unit.
@pytest.mark.parametrize(
    ("factor", "names"),
    [
        (-1.0, {"sign_flipped"}),
        (180 / np.pi, {"position_in_degrees", "position_scaled"}),
        (0.0, {"channel_constant"}),
    ],
)
def test_wrong_signs_units_and_dead_channels_are_set_aside(
    robot: Robot, swing: Log, factor: float, names: set[str]
) -> None:
    """One log shows it, and the axis is set aside in all."""
    logs, found = without_unlike_encoders(robot, [changed(swing, factor), swing])
    (finding,) = (f for f in found if f.axis == 1)
    assert finding.name in names
    assert finding.severity == "flag"
    assert finding.field == "joint_position_1"
    for log in logs:
        assert log.joint_position_rad is None or np.isnan(log.joint_position_rad[:, 0]).all()


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_scale_off_by_a_tenth_is_seen_where_the_gear_is_stiff(
    robot: Robot, swing: Log, factor: float, request: pytest.FixtureRequest
) -> None:
    """In a single sine the torque is in phase with the angle: there a soft gear could be a scale, and stays."""
    _, found = without_unlike_encoders(robot, [changed(swing, factor)])
    stiff = "stiff" in request.node.callspec.id
    assert [f.name for f in found if f.axis == 1] == (["position_scaled"] if stiff else [])


def test_the_channel_of_another_axis_is_set_aside(robot: Robot, swing: Log) -> None:
    noise = np.random.default_rng(0).standard_normal(swing.n_samples)
    joint = np.array(swing.joint_position_rad)
    joint[:, 0] = 0.05 * noise
    _, found = without_unlike_encoders(robot, [replace(swing, joint_position_rad=joint)])
    assert [f.name for f in found if f.axis == 1] == ["axes_swapped"]


def test_logs_without_joint_encoders_stay_the_same(robot: Robot, swing: Log) -> None:
    bare = replace(swing, joint_position_rad=None)
    logs, found = without_unlike_encoders(robot, [bare])
    assert logs == [bare]
    assert found == ()
