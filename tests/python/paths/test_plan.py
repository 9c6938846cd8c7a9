"""Planned motions: closed forms, limits, one limit always at work, and what is refused."""

import numpy as np
import pytest

import axisight
from axisight.errors import InputError
from axisight.excitation import Limits, read_references, write_references
from axisight.paths import joint_path, motion_references, plan

pytest.importorskip("toppra", reason="toppra comes with the extra `paths`")

# Reserve of every limit, as the docstring states it, and one sample of waiting at the end.
KEPT = 0.99


@pytest.fixture(scope="module")
def arm():
    return axisight.load_robot("irb6600_like")


@pytest.fixture(scope="module")
def axis():
    """An axis without gravity or friction: its torque is inertia times acceleration."""
    robot = axisight.load_robot("two_mass_axis")
    return robot.with_parameters(
        {name: 0.0 for name in robot.parameters() if name.endswith("viscous_friction")}
    )


def test_a_straight_move_has_the_duration_of_a_trapezoid(axis):
    """Length / v + v / a: full acceleration up to full speed, and back."""
    length = 1.0 / axis.gear_ratio[0]
    motion = plan(axis, joint_path(axis, [[0.0], [1.0]]), Limits(200.0, 1500.0))
    v, a = KEPT * 200.0, KEPT * 1500.0
    # The grid of 400 points rounds each corner of the trapezoid by less than one of its steps.
    assert motion.attrs["duration_s"] == pytest.approx(length / v + v / a, rel=1 / 400)


def test_torque_alone_makes_a_move_of_two_halves(axis):
    """2 sqrt(length / a) with a = torque / inertia on the motor side."""
    known = axis.parameters()
    ratio = float(axis.gear_ratio[0])
    moved = float(axis.inertia_matrix(np.zeros(axis.n_joints))[0, 0])
    joint = axis.joint_names[axis.axis_joints[0]]
    inertia = known[f"{joint}.motor_inertia"] + ratio**2 * moved
    motion = plan(axis, joint_path(axis, [[0.0], [1.0]]), Limits(1e5, 1e6, torque_nm=30.0))
    expected = 2 * np.sqrt(1.0 / ratio * inertia / (KEPT * 30.0))
    assert motion.attrs["duration_s"] == pytest.approx(expected, rel=1 / 400)


def test_limits_are_kept_and_one_of_them_is_always_at_work(arm):
    limits = Limits(200.0, 1500.0, torque_nm=[60.0, 60.0, 40.0])
    points = [[0.0, 0.0, 0.0], [0.5, 0.3, -0.2], [1.0, -0.2, 0.1]]
    path = joint_path(arm, points)
    motion = plan(arm, path, limits)
    shares = np.stack(
        [
            np.abs(motion[name].values) / limit
            for name, limit in (
                ("velocity_ref_rad_s", 200.0),
                ("acceleration_rad_s2", 1500.0),
                ("torque_nm", np.array([60.0, 60.0, 40.0])),
            )
        ]
    )
    assert shares.max() <= 1.0
    assert shares.max() == pytest.approx(motion.attrs["largest_share"])
    what, _, axis = np.unravel_index(np.argmax(shares), shares.shape)
    assert (
        motion.attrs["reached"]
        == f"the {('velocity', 'acceleration', 'torque')[what]} limit of axis {axis + 1}"
    )
    # The fastest motion has a limit at work at every moment (Pontryagin). What is taken from the torque for
    # viscous friction, 2 Nm of 60, is not there when the motor is slow.
    at_work = shares.max(axis=(0, 2))[1:-2]
    assert np.mean(at_work > 0.9) > 0.95
    assert motion["joint_position_rad"].values[0] == pytest.approx(points[0], abs=1e-12)
    assert motion["joint_position_rad"].values[-1] == pytest.approx(points[-1], abs=1e-9)
    # Held references move the motors along.
    moved = (
        np.cumsum(motion["velocity_ref_rad_s"].values, axis=0) * arm.sample_time_s * arm.gear_ratio
    )
    assert moved[-1] == pytest.approx(points[-1], abs=1e-9)


def test_the_motion_passes_its_waypoints(arm):
    points = np.array([[0.0, 0.0, 0.0], [0.5, 0.3, -0.2], [1.0, -0.2, 0.1]])
    motion = plan(arm, joint_path(arm, points), Limits(200.0, 1500.0))
    distance = np.linalg.norm(motion["joint_position_rad"].values - points[1], axis=1)
    # Half a sample at full speed, 200 rad/s at the motor.
    assert distance.min() < 0.5 * 200 * np.linalg.norm(arm.gear_ratio) * arm.sample_time_s


def test_the_simulated_robot_follows(arm):
    motion = plan(arm, joint_path(arm, [[0.0, 0.0, 0.0], [0.4, 0.2, -0.2]]), Limits(100.0, 500.0))
    references = np.concatenate([motion["velocity_ref_rad_s"].values, np.zeros((400, 3))])
    run = axisight.simulate(arm, references, start_rad=[0.0, 0.0, 0.0])
    position = run["motor_position_rad"].values
    # The integral part of the controller brings the motors to the end of the path within 0.4 s.
    assert (position[-1] - position[0]) * arm.gear_ratio == pytest.approx(
        [0.4, 0.2, -0.2], abs=2e-3
    )


def test_references_go_through_a_file(arm, tmp_path):
    motion = plan(arm, joint_path(arm, [[0.0, 0.0, 0.0], [0.4, 0.2, -0.2]]), Limits(100.0, 500.0))
    written = motion_references(motion)
    write_references(written, tmp_path / "motion.csv")
    again = read_references(tmp_path / "motion.csv")
    assert np.array_equal(again.period, written.period)
    assert again.design["duration_s"] == motion.attrs["duration_s"]


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        (Limits(None, 500.0), "limits.velocity_rad_s: expected a number"),
        (Limits(100.0, None), "limits.acceleration_rad_s2: expected a number"),
        (Limits(100.0, -5.0), "positive numbers"),
        (Limits(100.0, 500.0, torque_nm=[60.0, 5.0, 60.0]), "that holds the robot"),
        (Limits([100.0, 50.0], 500.0), "velocity_rad_s"),
    ],
)
def test_wrong_limits_are_refused(arm, limits, message):
    with pytest.raises(InputError, match=message):
        plan(arm, joint_path(arm, [[0.0, 0.0, 0.0], [0.4, 0.2, -0.2]]), limits)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.0, 0.0, 0.0]], "n >= 2"),
        ([[0.0, 0.0], [1.0, 1.0]], "shape"),
        ([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "points 1 and 2 are equal"),
    ],
)
def test_wrong_waypoints_are_refused(arm, points, message):
    with pytest.raises(InputError, match=message):
        joint_path(arm, points)
