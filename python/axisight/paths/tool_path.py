"""Paths of the tool: joint positions along a Cartesian curve, by inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from axisight.arguments import Real, number, one_of, reals, switch, whole
from axisight.errors import InputError
from axisight.paths.joint_path import JointPath, within_ranges
from axisight.robot import Robot
from axisight.robot.branches import refuse_branches

# Newton steps to the next point of a path, and how exactly it is reached [m and rad].
_STEPS = 50
_REACHED = 1e-10
# Damping of a step [m^2 per rad^2], beside which a singular pose shows as slow convergence.
_DAMPING = 1e-9
# Longest step of a joint [rad or m]: a longer one leaves the branch of the solution.
_LONGEST_STEP = 0.2


def tool_path(
    robot: Robot,
    positions_m: ArrayLike,
    start_rad: ArrayLike,
    *,
    kind: str = "line",
    keep_orientation: bool = False,
    point_m: Sequence[float] = (0.0, 0.0, 0.0),
    points_between: int = 50,
) -> JointPath:
    """Return joint positions that move a point of the tool along a Cartesian curve.

    Parameters
    ----------
    robot : the robot. Elastic joints stay undeflected, except that they carry the robot's weight at ``start_rad``.
    positions_m : (n, 3) positions of the point [m] in the base frame, which the tool passes after its position at
        ``start_rad``.
    start_rad : (n_axes,) positions of the driven joints [rad; m if prismatic] at the start. It chooses the branch of
        the inverse kinematics.
    kind : ``"line"`` for one straight line, which allows one position; ``"curve"`` for a cubic spline through all
        positions. The tool runs through a corner only at rest: plan each line of a polygon by itself.
    keep_orientation : whether the tool keeps its orientation; needs six axes or more.
    point_m : (3,) the point in the frame of the last link [m].
    points_between : positions between two of ``positions_m`` at which inverse kinematics is solved. A spline joins
        them; its error falls with the fourth power of their distance.

    The solution is that of least joint motion from one position to the next (damped Newton steps).
    Raises InputError for wrong arguments and for a position that the robot does not reach, and RobotError for a
    robot with branches, which has no one tool.

    """
    refuse_branches(robot, "a path of the tool")
    start = reals("start_rad", start_rad, f"finite numbers of shape ({robot.n_axes},)", 1)
    given = reals("positions_m", positions_m, "finite numbers of shape (n, 3)", 2)
    if given.shape[1] != 3 or not len(given):
        raise InputError(f"positions_m: expected shape (n, 3), got {given.shape}")
    if one_of("kind", kind, ("line", "curve")) == "line" and len(given) > 1:
        raise InputError(
            f"positions_m: a line has one end, got {len(given)} positions. Give kind='curve', or plan line by line"
        )
    if switch("keep_orientation", keep_orientation) and robot.n_axes < 6:
        raise InputError(
            f"keep_orientation: expected a robot of six axes or more, got {robot.n_axes} axes"
        )
    point = [number("point_m", x) for x in point_m]
    tool = _Tool(robot, start, point, keep_orientation)
    corners = np.concatenate([[tool.position(start)], given])
    at, wanted = _sampled(corners, whole("points_between", points_between))
    angles = [start]
    for s, position in zip(at[1:], wanted[1:], strict=True):
        angles.append(tool.solve(angles[-1], position, f"{s / at[-1]:.0%} along"))
    return within_ranges(robot, JointPath(CubicSpline(at, np.array(angles))))


def _sampled(corners: Real, between: int) -> tuple[Real, Real]:
    """Return distances (n,) along the curve through ``corners`` and its points (n, 3) [m]."""
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not steps.all():
        k = int(np.flatnonzero(steps == 0)[0])
        raise InputError(f"positions_m: position {k + 1} equals the one before it; leave it out")
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    curve = CubicSpline(knots, corners, bc_type="natural")
    numbers = np.arange((between + 1) * len(steps) + 1) / (between + 1)
    at = np.interp(numbers, np.arange(len(knots)), knots)
    return at, np.asarray(curve(at))


class _Tool:
    """The point of the tool, moved by the driven joints while all others keep their positions."""

    def __init__(self, robot: Robot, start: Real, point: list[float], oriented: bool) -> None:
        self.robot, self.point, self.oriented = robot, point, oriented
        self.rest = robot.equilibrium(start.tolist())["joint_angle_rad"].values.astype(float)
        self.rotation = Rotation.from_matrix(self._pose(start)[0])

    def _joints(self, axes: Real) -> Real:
        joints = self.rest.copy()
        joints[self.robot.axis_joints] = axes
        return joints

    def _pose(self, axes: Real) -> tuple[Real, Real]:
        rotation, origin = self.robot.pose(self._joints(axes))
        return rotation, origin + rotation @ np.array(self.point)

    def position(self, axes: Real) -> Real:
        """Return the position of the point (3,) [m]."""
        return self._pose(axes)[1]

    def _error(self, axes: Real, position: Real) -> Real:
        rotation, at = self._pose(axes)
        if not self.oriented:
            return position - at
        turned = (self.rotation * Rotation.from_matrix(rotation).inv()).as_rotvec()
        return np.concatenate([position - at, turned])

    def solve(self, axes: Real, position: Real, where: str) -> Real:
        """Return joint positions (n_axes,) that reach ``position``, near ``axes``."""
        rows = 6 if self.oriented else 3
        for _ in range(_STEPS):
            error = self._error(axes, position)
            if np.linalg.norm(error) < _REACHED:
                return axes
            jacobian = self.robot.jacobian(self._joints(axes), -1, self.point)
            moved = jacobian[:rows, self.robot.axis_joints]
            damped = moved @ moved.T + _DAMPING * np.eye(rows)
            step = moved.T @ np.linalg.solve(damped, error)
            axes = axes + step * min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        left = float(np.linalg.norm(self._error(axes, position)))
        raise InputError(
            f"positions_m: {where} the path, {position.round(4).tolist()} m, is out of reach: {left:.3g} m is left. "
            "Expected positions inside the workspace, away from singular poses"
        )
