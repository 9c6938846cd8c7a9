"""Causes that leave too much of what is seen stand for a law that is not among the effects."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Log, Robot, Settings
from axisight.gap.verdict.conclusion import _too_little
from axisight.gap.views.choice import view_of


@pytest.mark.parametrize(
    ("explained", "left", "adds_up", "too_little"),
    [
        (0.5, 0.1, False, True),  # less than is asked for
        (0.79, 68.0, False, True),  # a fifth left, and seen
        (0.79, 1.0, False, False),  # a fifth left, of the size of noise
        (0.95, 68.0, False, False),  # what two formulas of one law differ by
        (0.79, 68.0, True, False),  # by inverse dynamics much is left that nothing explains
    ],
)
def test_what_is_left_is_held_against_noise_and_against_what_is_explained(
    explained: float, left: float, adds_up: bool, too_little: bool
) -> None:
    samples = np.array([10.0, 30.0])
    found = SimpleNamespace(
        left=lambda: left * samples,
        layout=SimpleNamespace(samples=lambda: samples),
        adds_up=adds_up,
    )
    assert _too_little(found, explained, Settings()) is too_little


def lever(axis: list[float]) -> Robot:
    """A link on one joint, rigid, at a sample time of 10 ms."""
    return Robot.from_toml(
        f"""schema = "axisight.robot/2"
name = "lever"
gravity = [0.0, 0.0, -9.81]
sample_time = 0.01
[[joint]]
name = "j1"
kind = "driven"
motion = "revolute"
origin = [0.0, 0.0, 0.0]
axis = {axis}
[joint.drive]
gear_ratio = 1.0
motor_inertia = 0.1
viscous_friction = 0.0
[joint.link]
mass = 10.0
com = [0.4, 0.0, 0.0]
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
[controller]
kind = "none"
"""
    )


@pytest.mark.parametrize(("axis", "offered"), [([0.0, 0.0, 1.0], False), ([0.0, 1.0, 0.0], True)])
def test_a_load_on_a_single_axis_is_offered_where_it_is_lifted(
    axis: list[float], offered: bool
) -> None:
    robot = lever(axis)
    time = 0.01 * np.arange(1000)
    angle = np.sin(3 * time)[:, None]
    torque = robot.inverse_dynamics(angle, 3 * np.cos(3 * time)[:, None], -9 * angle)
    random = np.random.default_rng(0)
    log = Log(
        name="run",
        source=Path("run"),
        sample_time_s=0.01,
        time_s=time,
        position_rad=angle + 1e-5 * random.normal(size=angle.shape),
        torque_nm=torque + 0.1 * random.normal(size=angle.shape),
    )
    view = view_of(robot, [log], [log], Settings())
    found = {o.effect.label for o in view.candidates(view.fitter.fit([]), axes=[1])}
    assert "link_mass@1" in found
    assert ("payload" in found) is offered
