"""Deflection of gears with an encoder on either side: what is measured, what the simulator has, what is play."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Robot, load_robot, simulate
from axisight.gap.measure.gear_deflections import gears_seen, gears_that_differ
from axisight.gap.signals.both_encoders import deflection, play_rad, swings
from axisight.logs import Log

PLAY_RAD = 0.004


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("irb6600_like")


def recorded(robot: Robot, *effects: Effect, offset_rad: float = 0.0) -> Log:
    """Return a log of slow swings of the first axis, with an encoder on each joint."""
    time = robot.sample_time_s * np.arange(int(8.0 / robot.sample_time_s))
    speed = np.zeros((len(time), robot.n_axes))
    speed[:, 0] = 60 * np.sin(2 * np.pi * 0.5 * time)
    run = simulate(robot, speed, effects=effects)
    joints = run["joint_position_rad"].to_numpy()[:, robot.axis_joints]
    return Log(
        name="swings",
        source="simulation",
        time_s=time,
        sample_time_s=robot.sample_time_s,
        position_rad=run["position_rad"].to_numpy(),
        torque_nm=run["torque_cmd_nm"].to_numpy(),
        velocity_ref_rad_s=speed,
        joint_position_rad=joints + offset_rad,
    )


def test_the_gear_of_the_simulator_deflects_as_it_does(robot: Robot):
    (first, *_) = swings(recorded(robot, offset_rad=0.2), robot)
    assert first is not None
    # Medians over swings whose acceleration the low-pass takes by a per cent, and rings of the gear around them.
    assert first.measured_rad == pytest.approx(first.simulated_rad, rel=0.05)
    assert first.play_rad < 0.1 * first.measured_rad
    log = recorded(robot)
    assert gears_that_differ(robot, [log]) == ()
    assert "axis 1" in gears_seen(robot, [log])[0]


def test_play_shows_with_its_width(robot: Robot):
    log = recorded(robot, Effect("backlash", 1, {"half_width_rad": PLAY_RAD, "damped": 1.0}))
    (first, *_) = swings(log, robot)
    assert first is not None
    # Impacts throw the teeth apart again: some deflections lie inside the gap, and medians are that much smaller.
    assert play_rad([log], robot, 0) == pytest.approx(PLAY_RAD, rel=0.15)
    assert 0.5 * PLAY_RAD < first.play_rad < 1.05 * PLAY_RAD
    (finding,) = (f for f in gears_that_differ(robot, [log]) if f.axis == 1)
    assert finding.name == "gear_gives_way"
    assert "in play" in finding.message


def test_a_softer_gear_is_no_play(robot: Robot):
    log = recorded(robot, Effect("joint_stiffness", 1, {"relative_change": -0.7}))
    (first, *_) = swings(log, robot)
    assert first is not None
    assert first.measured_rad == pytest.approx(first.simulated_rad / 0.3, rel=0.1)
    assert first.play_rad < 0.1 * first.measured_rad
    assert play_rad([log], robot, 0) == 0.0
    assert next(f.axis for f in gears_that_differ(robot, [log])) == 1


def test_nothing_is_said_without_an_encoder_on_the_joint(robot: Robot):
    log = recorded(robot)
    bare = replace(log, joint_position_rad=None)
    assert deflection(bare, robot) is None
    assert gears_seen(robot, [bare]) == ()
    assert gears_that_differ(robot, [bare]) == ()
    partly = np.array(log.joint_position_rad)
    partly[:, 0] = np.nan
    assert swings(replace(log, joint_position_rad=partly), robot)[0] is None
