"""Files of joint trajectories: what a controller makes of them is the motion that was designed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.interpolate import BPoly

from axisight import InputError, load_robot
from axisight.excitation import References
from axisight.paths import JointTrajectory, joint_trajectory, write_joint_trajectory
from axisight.paths.trajectory import APPROACH_S

STEP_S = 1e-3
ROBOT = load_robot("two_mass_axis")


def references(seconds: float = 4.0) -> References:
    """A smooth motion from rest to rest."""
    time = np.arange(round(seconds / STEP_S)) * STEP_S
    speed = np.sin(np.pi * time / seconds) ** 4 * np.sin(4 * np.pi * time / seconds)
    return References(STEP_S, speed[None, :, None])


@pytest.fixture
def trajectory() -> JointTrajectory:
    return joint_trajectory(references(), ROBOT, [2.0])


def test_joints_follow_their_motors(trajectory: JointTrajectory) -> None:
    """Identity: a motor moves by its speed times the sample time, a joint by that times the gear ratio."""
    ratio, speed = ROBOT.gear_ratio[0], references().period[0, :, 0]
    np.testing.assert_allclose(trajectory.position[0], 2.0 * ratio)
    moved = np.diff(trajectory.position[:, 0]) / STEP_S
    # Rounding of positions near 2 rad, over a sample.
    np.testing.assert_allclose(moved, ratio * speed, atol=1e-15 / STEP_S)
    assert trajectory.joint_names == tuple(ROBOT.axis_names)


def test_a_csv_file_holds_every_sample(trajectory: JointTrajectory, tmp_path: Path) -> None:
    read = pd.read_csv(write_joint_trajectory(trajectory, tmp_path / "t.csv"))
    (name,) = trajectory.joint_names
    assert list(read) == ["time_s", f"position_{name}", f"velocity_{name}", f"acceleration_{name}"]
    np.testing.assert_array_equal(read[f"position_{name}"], trajectory.position[:, 0])


def test_a_ros_controller_follows_the_motion(trajectory: JointTrajectory, tmp_path: Path) -> None:
    """Oracle: quintic polynomials of SciPy through the points that another YAML reader finds."""
    text = write_joint_trajectory(trajectory, tmp_path / "t.yaml").read_text("utf-8")
    message = yaml.safe_load(text)
    assert set(message) == {"header", "joint_names", "points"}
    assert message["joint_names"] == list(trajectory.joint_names)
    points = message["points"]
    due = [p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points]
    assert due[0] == APPROACH_S
    assert np.all(np.diff(due) > 0)
    assert due[-1] == pytest.approx(APPROACH_S + trajectory.time_s[-1], abs=1e-9)
    state = [[p[k][0] for k in ("positions", "velocities", "accelerations")] for p in points]
    course = BPoly.from_derivatives(np.array(due) - APPROACH_S, state)(trajectory.time_s)
    travel = np.ptp(trajectory.position)
    # A thousandth of the travel, and numbers of eight decimals.
    assert np.abs(course - trajectory.position[:, 0]).max() <= 1e-3 * travel + 1e-8
    assert len(points) < len(trajectory.position) / 10


def test_a_motion_with_steps_of_speed_keeps_every_sample() -> None:
    speed = np.repeat([1.0, -1.0, 1.0, -1.0], 2)[None, :, None]
    found = joint_trajectory(References(STEP_S, speed), ROBOT, [0.0])
    assert found.few_points() == list(range(9))


def test_misuse_is_refused(trajectory: JointTrajectory, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ending in .csv or .yaml"):
        write_joint_trajectory(trajectory, tmp_path / "t.bag")
    with pytest.raises(InputError, match="start: expected 1 finite"):
        joint_trajectory(references(), ROBOT, [0.0, 1.0])
    with pytest.raises(InputError, match=r"velocities \[rad/s\], got 2"):
        joint_trajectory(References(STEP_S, np.zeros((1, 4, 2))), ROBOT, [0.0])
    with pytest.raises(InputError, match="n_samples >= 2"):
        JointTrajectory(("a",), STEP_S, *np.zeros((3, 4, 2)))
