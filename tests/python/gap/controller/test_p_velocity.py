"""Loops without an integral: what keeps a simulator on their logs keeps its angle too."""

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Robot, diagnose
from axisight.gap.controller.feedback import inertia_of_motors
from axisight.gap.controller.speed_loop import with_integral
from gap_data import bare_axis, log_of

SLIDE = """
schema = "axisight.robot/1"
name = "slide"
gravity = [0.0, 0.0, -9.81]
sample_time = 1e-3

[[joint]]
name = "x"
kind = "driven"
motion = "prismatic"
axis = [1.0, 0.0, 0.0]
origin = [0.0, 0.0, 0.0]
[joint.link]
mass = 30.0
com = [0.0, 0.0, 0.0]
inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = 0.003
motor_inertia = 3e-4
viscous_friction = 2e-3

[controller]
kind = "p_velocity"
kp = [0.05]

[sensor]
position_noise_std = 2e-5
"""
OFF = {"x.viscous_friction": 1.03, "x.mass": 0.99, "x.motor_inertia": 1.01}


def machine() -> Robot:
    robot = Robot.from_toml(SLIDE)
    own = robot.parameters()
    return robot.with_parameters(own | {name: own[name] * factor for name, factor in OFF.items()})


def to_and_fro(speed_rad_s: float, period_s: float) -> NDArray[np.float64]:
    time = np.arange(8000) * 1e-3
    wave = np.sin(2 * np.pi * time / period_s)
    return (speed_rad_s * np.tanh(3 * wave) * np.minimum(time, 1.0))[:, None]


PLAN = ((30.0, 4.0), (250.0, 2.0), (80.0, 2.7), (180.0, 2.0), (70.0, 2.5))


def test_the_loop_of_a_rigid_motor_is_critically_damped():
    """``J s^2 + k_p s + k_i`` has one double root."""
    loop = with_integral(Robot.from_toml(SLIDE))
    kp, ki = loop.controller_gains["kp"][0], loop.controller_gains["ki"][0]
    inertia = inertia_of_motors(loop)[0, 0]
    assert inertia == pytest.approx(3e-4 + 0.003**2 * 30.0)
    assert kp**2 - 4 * inertia * ki == pytest.approx(0.0, abs=1e-12 * kp**2)
    assert with_integral(bare_axis()).controller_gains == bare_axis().controller_gains


def test_cogging_that_a_weak_loop_strays_by_is_named():
    """Without an integral the simulator strays from the log by several waves, and no fit finds the way."""
    cogging = Effect(
        "torque_ripple",
        1,
        {"order_1": 8.0, "order_2": 24.0, "cosine_1_nm": 0.035, "sine_2_nm": 0.013},
    )
    logs = [log_of(machine(), [cogging], to_and_fro(*p), k) for k, p in enumerate(PLAN)]
    said = diagnose(robot=Robot.from_toml(SLIDE), estimation=logs[:3], validation=logs[3:])
    assert said.verdict == "explained"
    assert [c.label for c in said.causes] == ["torque_ripple@1"]
    found = said.causes[0].parameters
    assert found["cosine_1_nm"].value == pytest.approx(0.035, rel=0.02)
    assert found["sine_2_nm"].value == pytest.approx(0.013, rel=0.05)
    assert said.causes[0].gap_reduction.value > 0.95
