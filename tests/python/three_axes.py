"""A small arm for the tests of rigid-body identification."""

from axisight import Robot, _core

TEXT = """
schema = "axisight.robot/1"
name = "three axes"
gravity = [0, 0, -9.81]
sample_time = 1e-2
[[joint]]
name = "turn"
kind = "driven"
origin = [0, 0, 0.5]
axis = [0, 0, 1]
link = { mass = 20, com = [0.1, 0, 0.05], inertia = [1, 1.2, 0.8, 0.1, -0.1, 0.05] }
drive = { gear_ratio = 0.01, motor_inertia = 0.001, viscous_friction = 0.001 }
[[joint]]
name = "lift"
kind = "driven"
origin = [0.1, 0.2, 0.3]
axis = [0, 0.8, 0.6]
link = { mass = 12, com = [0.2, -0.1, 0.3], inertia = [1, 1.2, 0.7, 0.05, 0.1, -0.1] }
drive = { gear_ratio = 0.01, motor_inertia = 0.001, viscous_friction = 0.001 }
[[joint]]
name = "reach"
kind = "driven"
MOTION
origin = [0.2, 0, 0.5]
axis = [0, 1, 0]
link = { mass = 5, com = [0.3, 0, 0.1], inertia = [0.2, 0.3, 0.25, 0.01, 0, 0.02] }
drive = { gear_ratio = 0.01, motor_inertia = 0.001, viscous_friction = 0.001 }
[controller]
kind = "none"
[sensor]
position_noise_std = 0
[operating_point]
joint_angle = [0, 0, 0]
"""


def robot(motion: str = "") -> Robot:
    return Robot(_core.Robot.from_toml(TEXT.replace("MOTION", motion)))
