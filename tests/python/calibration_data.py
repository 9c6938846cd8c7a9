"""A six-axis arm with elastic gears, for tests of calibration."""

import numpy as np

from axisight import Robot, _core
from axisight.calibration import Geometry, nominal_geometry
from axisight.calibration.geometry import GROUPS, errors_about
from axisight.calibration.measurements import Loads, load_torque

_JOINTS = [
    ("axis1", [0, 0, 0.4], [0, 0, 1], 1.2e6, 150, [0.1, 0, 0.1]),
    ("axis2", [0.3, 0, 0.2], [0, 1, 0], 1.5e6, 120, [0, 0.05, 0.5]),
    ("axis3", [0, 0, 1.0], [0, 1, 0], 9e5, 80, [0.1, 0, 0.1]),
    ("axis4", [0.5, 0, 0.15], [1, 0, 0], 2e5, 30, [0.3, 0, 0]),
    ("axis5", [0.5, 0, 0], [0, 1, 0], 1.5e5, 10, [0.02, 0, 0]),
    ("axis6", [0.1, 0, 0], [1, 0, 0], 1e5, 5, [0.05, 0, 0]),
]


def arm() -> Robot:
    text = (
        'schema = "axisight.robot/1"\nname = "arm"\n'
        "gravity = [0.0, 0.0, -9.81]\nsample_time = 1e-3\n"
    )
    for name, origin, axis, stiffness, mass, com in _JOINTS:
        text += (
            f'[[joint]]\nname = "{name}"\nkind = "driven"\norigin = {origin}\naxis = {axis}\n'
            f"stiffness = {stiffness}\ndamping = 100.0\n"
            f"link = {{ mass = {mass}, com = {com}, inertia = [5, 5, 5, 0, 0, 0] }}\n"
            "drive = { gear_ratio = 0.01, motor_inertia = 0.01, viscous_friction = 0.01 }\n"
        )
    text += (
        '[controller]\nkind = "none"\n[sensor]\nposition_noise_std = 0\n'
        "[operating_point]\njoint_angle = [0, 0, 0, 0, 0, 0]\n"
    )
    return Robot(_core.Robot.from_toml(text))


LOADS = Loads(payload_com_m=(0.1, 0.0, 0.05))


def nominal(robot: Robot) -> Geometry:
    return nominal_geometry(
        robot, tool_position_m=(0.2, 0.05, 0.1), base_position_m=(2.0, -1.0, 0.1)
    )


def configurations(n, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (n, 6)) * [2.5, 0.9, 0.9, 2.5, 1.8, 2.5]


def truth(robot: Robot, seed=1, groups=GROUPS, size=1e-3, rotation=True):
    """Return geometry errors of about 1 mm and 1 mrad, with compliances off by a fifth."""
    start = nominal(robot)
    errors = errors_about(start, groups, rotation=rotation)
    theta = np.random.default_rng(seed).normal(0, size, len(errors.names))
    for k, (group, joint, _) in enumerate(errors.kinds):
        if group == "compliance":
            theta[k] = 0.2 * start.compliance_rad_nm[joint] * (-1) ** joint
    return errors, theta


def measured(robot, geometry, q, payload=0.0):
    """Return noise-free rotations and positions of the target."""
    mass = np.broadcast_to(payload, (len(q),))
    return geometry.tool_location(q, load_torque(robot, q, mass, LOADS))
