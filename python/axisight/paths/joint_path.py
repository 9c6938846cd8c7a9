"""Smooth paths of the driven joints: a curve without a time law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from axisight.arguments import reals
from axisight.errors import InputError
from axisight.robot import Robot


@dataclass(frozen=True, eq=False)
class JointPath:
    """A twice differentiable curve q(s) of the driven joints, for 0 <= s <= ``length``.

    ``curve`` gives angles [rad; m if prismatic] of shape (n, n_axes) for s of shape (n,), and derivatives by its
    second argument.
    """

    curve: CubicSpline

    @property
    def length(self) -> float:
        """Value of s at the end."""
        return float(self.curve.x[-1])

    @property
    def n_axes(self) -> int:
        """Number of driven joints."""
        return int(self.curve.c.shape[2])


def joint_path(robot: Robot, waypoints_rad: ArrayLike) -> JointPath:
    """Return the cubic spline through joint positions, along their distance in joint space.

    Parameters
    ----------
    robot : the robot, whose joint ranges hold if its model states them.
    waypoints_rad : (n, n_axes) positions of the driven joints [rad; m if prismatic], n >= 2. Two points make a
        straight line.

    Raises InputError for another shape, for two equal points in a row, and for a path that leaves the range of
    a joint.

    """
    points = reals(
        "waypoints_rad", waypoints_rad, f"finite numbers of shape (n, {robot.n_axes}), n >= 2", 2
    )
    if points.shape[1] != robot.n_axes or len(points) < 2:
        raise InputError(
            f"waypoints_rad: expected shape (n, {robot.n_axes}) with n >= 2, got {points.shape}"
        )
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not steps.all():
        k = int(np.flatnonzero(steps == 0)[0])
        raise InputError(f"waypoints_rad: points {k + 1} and {k + 2} are equal; leave one out")
    at = np.concatenate([[0.0], np.cumsum(steps)])
    # Without curvature at its ends, a curve through few points swings least.
    return within_ranges(robot, JointPath(CubicSpline(at, points, bc_type="natural")))


def within_ranges(robot: Robot, path: JointPath) -> JointPath:
    """Return the path. Raises InputError where it leaves the range of a joint that the robot's model states."""
    grid = np.linspace(0.0, path.length, 1000)
    angle = path.curve(grid)
    for axis, bounds in enumerate(robot.joint_ranges):
        if bounds is None:
            continue
        low, high = bounds
        lowest, highest = float(angle[:, axis].min()), float(angle[:, axis].max())
        # Rounding of a waypoint on the bound is no fault.
        if lowest < low - 1e-9 or highest > high + 1e-9:
            name = robot.axis_names[axis]
            raise InputError(
                f"path: joint {name}: expected {low:.4g} to {high:.4g} (the range of the model), "
                f"got {lowest:.4g} to {highest:.4g}. Move the waypoints or add some"
            )
    return path
