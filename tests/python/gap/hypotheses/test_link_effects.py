"""Effects of links and of the base: what they change is the robot's own description, changed."""

import numpy as np
import pytest

from axisight import Effect, RobotError, load_robot, simulate
from axisight.errors import InputError

PRESET = "irb6600_like"


def preset():
    return load_robot(PRESET).with_effects([])


def reference(robot, seconds=0.4):
    n = round(seconds / robot.sample_time_s)
    time = np.arange(n) * robot.sample_time_s
    return np.column_stack([5 * np.sin(2 * np.pi * f * time) for f in (3.0, 4.0, 5.0)])


def torque(robot, effects=()):
    run = simulate(robot, reference(robot), effects=list(effects), method="rk4")
    assert run.attrs["status"] == "completed"
    return run.torque_cmd_nm.values


@pytest.mark.parametrize(
    ("effect", "parameter", "change"),
    [
        (Effect("link_mass", 1, {"relative_change": 0.2}), "axis1.mass", lambda x: 1.2 * x),
        # The second axis moves its link through an elastic joint.
        (Effect("link_mass", 2, {"relative_change": -0.1}), "axis2_yaw.mass", lambda x: 0.9 * x),
        (
            Effect("link_inertia", 3, {"relative_change": 0.5}),
            "axis3_yaw.inertia_scale",
            lambda x: 1.5 * x,
        ),
        (Effect("link_com", 3, {"y_m": 0.05}), "axis3_yaw.com_y", lambda x: x + 0.05),
    ],
    ids=lambda x: getattr(x, "label", ""),
)
def test_a_link_effect_is_the_parameter_it_changes(effect, parameter, change):
    robot = preset()
    known = robot.parameters()
    changed = robot.with_parameters({parameter: change(known[parameter])})
    mine, wanted, bare = torque(robot, [effect]), torque(changed), torque(robot)
    # The same numbers by another order of multiplication.
    np.testing.assert_allclose(mine, wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())
    assert np.abs(wanted - bare).max() > 1e-4 * np.abs(bare).max()


def test_parameters_of_an_axis_are_found_where_they_are():
    robot = preset()
    assert robot.axis_parameter(2, "stiffness") == "axis2.stiffness"
    assert robot.axis_parameter(2, "mass") == "axis2_yaw.mass"
    assert robot.axis_parameter(1, "nothing") is None


def test_a_rocking_base_rings_at_its_frequency():
    """A rigid body on one spring: k of one over the compliance, inertia about the base."""
    robot = preset()
    compliance = 4e-6
    effect = Effect("base_compliance", None, {"about_y_rad_nm": compliance, "damping_s": 0.0})
    q = np.zeros(robot.n_joints)
    q[robot.axis_joints] = robot.operating_point
    inertia = 0.0
    for i, joint in enumerate(robot.joints):
        if joint.link is None:
            continue
        rotation, position = robot.pose(q, i)
        com = position + rotation @ joint.link.com_m
        xx, yy, zz, xy, xz, yz = joint.link.inertia_kg_m2
        tensor = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
        inertia += tensor[1, 1] + joint.link.mass_kg * (com[0] ** 2 + com[2] ** 2)
    expected_hz = np.sqrt(1 / (compliance * inertia)) / (2 * np.pi)
    # A short push on the second axis, then silence; the arm's own modes are ten times as fast.
    n = 8000
    push = np.zeros((n, 3))
    push[:40, 1] = 10.0
    run = simulate(robot, push, effects=[effect], method="rk4")
    assert run.attrs["status"] == "completed"
    ring = run.torque_cmd_nm.values[1000:, 1]
    spectrum = np.abs(np.fft.rfft((ring - ring.mean()) * np.hanning(len(ring)), 16 * len(ring)))
    frequency = np.fft.rfftfreq(16 * len(ring), robot.sample_time_s)
    band = frequency < 5.0
    measured_hz = frequency[band][np.argmax(spectrum[band])]
    # Gravity above the joint takes m g h of the stiffness, and gears and controller give way a
    # little: within a tenth, where twice the compliance would be three tenths off.
    assert measured_hz == pytest.approx(expected_hz, rel=0.1)


def test_a_link_effect_needs_its_axis():
    with pytest.raises((InputError, RobotError), match="axis"):
        load_robot("two_mass_axis").with_effects([Effect("link_mass", 2, {"relative_change": 0.1})])
