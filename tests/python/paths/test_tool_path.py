"""Paths of the tool: straight lines, kept orientation, and positions out of reach."""

import numpy as np
import pytest

import axisight
from axisight.errors import InputError
from axisight.paths import tool_path

POINT = (1.2, 0.0, 0.2)


def poses(robot, path, start, point, count=301):
    """Return rotations (n, 3, 3) and positions (n, 3) of the point along a path."""
    joints = robot.equilibrium(list(start))["joint_angle_rad"].values
    found = []
    for axes in path.curve(np.linspace(0, path.length, count)):
        joints[robot.axis_joints] = axes
        rotation, origin = robot.pose(joints)
        found.append((rotation, origin + rotation @ np.array(point)))
    return [np.array(x) for x in zip(*found, strict=True)]


@pytest.fixture(scope="module")
def arm():
    return axisight.load_robot("irb6600_like")


def first(robot, start, point):
    joints = robot.equilibrium(list(start))["joint_angle_rad"].values
    rotation, origin = robot.pose(joints)
    return origin + rotation @ np.array(point)


def test_the_tool_follows_a_straight_line(arm):
    start = np.zeros(3)
    begin = first(arm, start, POINT)
    end = begin + np.array([-0.3, 0.8, -0.3])
    off = []
    for between in (10, 20):
        path = tool_path(arm, [end], start, point_m=POINT, points_between=between)
        position = poses(arm, path, start, POINT)[1]
        along = (end - begin) / np.linalg.norm(end - begin)
        moved = position - begin
        off.append(np.linalg.norm(moved - np.outer(moved @ along, along), axis=1).max())
        assert position[-1] == pytest.approx(end, abs=1e-9)
    # The error of a cubic spline falls with the fourth power of the step: (11 / 21)^4 = 1 / 13.
    assert off[1] < off[0] / 8
    assert off[1] < 1e-5


def test_a_curve_passes_its_positions(arm):
    start = np.zeros(3)
    begin = first(arm, start, POINT)
    wanted = begin + np.array([[-0.1, 0.4, -0.3], [-0.3, 0.8, 0.0]])
    path = tool_path(arm, wanted, start, kind="curve", point_m=POINT)
    position = poses(arm, path, start, POINT, 2001)[1]
    near = np.linalg.norm(position - wanted[0], axis=1).min()
    # Half the distance of two of the 2001 points on a curve of 1 m.
    assert near < 0.5 * path.length / 2000 + 1e-6


def test_six_axes_keep_the_orientation():
    robot = axisight.load_robot("cobot_like")
    start = np.array([0.1, -0.3, 1.2, -0.9, 0.9, 0.2])
    end = first(robot, start, (0, 0, 0.1)) + np.array([0.05, -0.15, 0.1])
    path = tool_path(robot, [end], start, keep_orientation=True, point_m=(0, 0, 0.1))
    rotation, position = poses(robot, path, start, (0, 0, 0.1))
    assert position[-1] == pytest.approx(end, abs=1e-9)
    assert np.abs(rotation - rotation[0]).max() < 1e-5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"positions_m": [[9.0, 0.0, 0.0]]}, "out of reach"),
        ({"positions_m": [[1.0, 0.0]]}, "shape"),
        ({"positions_m": [[1.5, 0.1, 2.0], [1.5, 0.2, 2.0]]}, "a line has one end"),
        ({"positions_m": [[1.5, 0.1, 2.0]], "keep_orientation": True}, "six axes"),
        ({"positions_m": [[1.5, 0.1, 2.0]], "kind": "arc"}, "kind"),
    ],
)
def test_wrong_positions_are_refused(arm, arguments, message):
    with pytest.raises(InputError, match=message):
        tool_path(arm, start_rad=[0.0, 0.0, 0.0], point_m=POINT, **arguments)


def test_a_path_beyond_the_range_of_a_joint_is_refused(monkeypatch):
    robot = axisight.load_robot("irb6600_like")
    monkeypatch.setattr(type(robot), "joint_ranges", property(lambda _: ((-0.1, 0.1), None, None)))
    with pytest.raises(InputError, match=r"-0.1 to 0.1"):
        axisight.paths.joint_path(robot, [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]])
