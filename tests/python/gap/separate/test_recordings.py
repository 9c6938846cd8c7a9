"""From recordings of ROS over an experiment to a decided verdict, and what a design costs on six axes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml

pytest.importorskip("mujoco")
pytest.importorskip("rosbags")


@pytest.fixture(scope="module")
def bench(request: pytest.FixtureRequest) -> Iterator[ModuleType]:
    """benches/next_experiment_ros.py: a MuJoCo arm under a trajectory controller, recorded as bags."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(request.config.rootpath / "benches"))
        import next_experiment_ros  # noqa: PLC0415 - a bench, on the path just now

        yield next_experiment_ros


@pytest.mark.parametrize("name", ["viscous, Coulomb friction", "spring of gravity, offset"])
def test_recordings_that_leave_causes_open_are_decided_by_the_played_message(
    bench: ModuleType, name: str, tmp_path: Path
) -> None:
    """Recovery on another engine, by the command alone: URDF and bags in, ROS message out, new bags in.

    One case is recorded as MCAP, the other with sqlite3.
    """
    cells, right = bench.run(bench.ROWS[name], tmp_path)
    assert cells[0].startswith("undecidable")
    assert right, cells
    told = (tmp_path / "next" / "experiment.txt").read_text("utf-8")
    assert "- speed: 2.5 rad/s (robot's model)" in told
    assert "- acceleration: 15 rad/s^2 (as given)" in told
    assert "- torque: 120, 45 Nm (robot's model)" in told
    message = yaml.safe_load((tmp_path / "next" / "trajectory.yaml").read_text("utf-8"))
    speeds = np.array([point["velocities"] for point in message["points"]])
    places = np.array([point["positions"] for point in message["points"]])
    # Eight decimals are written.
    assert np.abs(speeds).max() <= 2.5 + 1e-8
    assert np.all(places >= np.array([-0.6, -0.4]) - 1e-8)
    assert np.all(places <= np.array([1.4, 1.6]) + 1e-8)


def test_a_controller_passes_the_points_at_their_times(bench: ModuleType) -> None:
    """Identity: position at every point; from rest at the pose where the arm stands."""
    points = [
        ([0.1, 0.2], [0.0, 0.0], 5),
        ([0.3, 0.1], [0.1, -0.1], 6),
        ([0.1, 0.2], [0.0, 0.0], 8),
    ]
    message = {
        "joint_names": ["elbow", "shoulder"],
        "points": [
            {
                "positions": place,
                "velocities": speed,
                "accelerations": [0.0, 0.0],
                "time_from_start": {"sec": at, "nanosec": 0},
            }
            for place, speed, at in points
        ],
    }
    course = bench.controlled(message, np.array([0.5, -0.5]))
    at = [0, 5000, 6000]
    np.testing.assert_allclose(course[at], [[0.5, -0.5], [0.2, 0.1], [0.1, 0.3]], atol=1e-12)
    # At rest at the start, and with the speed of a point when it is passed.
    np.testing.assert_allclose(course[1] - course[0], 0.0, atol=1e-8)
    passed = (course[6001] - course[5999]) / 2e-3
    np.testing.assert_allclose(passed, [-0.1, 0.1], atol=1e-5)
