"""A hanging lever on position targets, as a robot file: with a rigid and with an elastic gear."""

RIGID = """
schema = "axisight.robot/2"
name = "lever"
gravity = [0.0, 0.0, -9.81]
sample_time = 0.002

[[joint]]
name = "lever"
kind = "driven"
motion = "revolute"
origin = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[joint.link]
mass = 1.5
com = [0.0, 0.0, -0.2]
inertia = [0.01, 0.01, 0.001, 0.0, 0.0, 0.0]

[joint.drive]
gear_ratio = 1.0
motor_inertia = 0.06
viscous_friction = 0.8

[controller]
kind = "pd_position"
kp = [150.0]
kd = [6.0]
velocity_feedforward = false

[sensor]
position_noise_std = 2e-5
"""
ELASTIC = RIGID.replace("[joint.link]", "stiffness = 250.0\ndamping = 1.0\n\n[joint.link]")
