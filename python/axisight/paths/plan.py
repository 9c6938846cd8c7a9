"""The fastest time law along a path within limits of velocity, acceleration and torque (TOPP-RA)."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import xarray as xr

from axisight.arguments import Real, instance, whole
from axisight.errors import InputError, MissingExtraError
from axisight.excitation.checks import per_item
from axisight.excitation.limits import Limits
from axisight.excitation.references import References
from axisight.paths.joint_path import JointPath
from axisight.robot import Robot

# Plans until the torque of viscous friction, which depends on the plan's speed, is allowed for.
_ROUNDS = 8
# Limits are kept at the points of the grid; between them and by sampling they may be passed by this share.
_MARGIN = 0.01


def plan(robot: Robot, path: JointPath, limits: Limits, *, grid_points: int = 400) -> xr.Dataset:
    """Return the fastest motion from rest to rest along a path, sampled at the controller's sample time.

    The method is time-optimal path parameterization by reachability analysis (Pham and Pham 2018, TOPP-RA). Torques
    are those of the robot with rigid joints: ``tau = J_m phi'' + F_v phi' + r (M q'' + c + g)``, with q = r phi. Of
    each limit, 1 % is kept in reserve for the motion between grid points.

    Parameters
    ----------
    robot : the robot. Elastic joints keep the deflection of the start; effects such as dry friction do not count, so
        leave room for them in ``limits.torque_nm``.
    path : of `joint_path` or `tool_path`.
    limits : limits of the motors. Velocity and acceleration are needed; torque [Nm] may be left out.
    grid_points : points along the path at which the limits are kept.

    Returns
    -------
    Dataset with dims (time, axis):

    - ``joint_position_rad``: positions of the driven joints [rad; m if prismatic];
    - ``position_ref_rad``, ``velocity_ref_rad_s``: references of the motors [rad], [rad/s], for `axisight.simulate`.
      A velocity reference that is held for one sample moves the motor to the next position;
    - ``acceleration_rad_s2``, ``torque_nm``: of the motors.

    Attributes: ``duration_s``, ``largest_share``, the largest share of a limit [1], and ``reached``, which limit
    that is: its name and the axis.
    Raises InputError if a limit is missing or the static torque alone passes it, and MissingExtraError without toppra.

    """
    instance("path", path, JointPath)
    instance("limits", limits, Limits)
    grid = np.linspace(0.0, path.length, whole("grid_points", grid_points, least=20))
    bound = _bounds(robot, limits)
    torques = _Torques(robot, path)
    if bound["torque"] is not None:
        _check_static(robot, torques, grid, bound["torque"])
    reserve = np.zeros(robot.n_axes)
    for _ in range(_ROUNDS):
        law = _time_law(robot, path, grid, bound, torques, reserve)
        motion = _sampled(robot, torques, law)
        share, reached = _largest_share(motion, bound)
        if share <= 1.0:
            motion.attrs |= {
                "duration_s": float(law.duration),
                "largest_share": share,
                "reached": reached,
            }
            return motion
        if bound["torque"] is None:
            break
        # The method cannot count viscous friction: what it makes of the torque is taken from the limit.
        excess = np.abs(motion["torque_nm"].values).max(axis=0) - bound["torque"]
        reserve = reserve + np.maximum(excess, 0.0) * 1.05
    raise InputError(
        f"limits: no plan keeps them: the last one takes {share:.1%} of {reached}. "
        "Expected more grid_points, or a smoother path"
    )


def motion_references(motion: xr.Dataset) -> References:
    """Return the velocity references of a planned motion, for `axisight.excitation.write_references`.

    They are one experiment whose period is the motion; the robot rests at its end. Raises InputError for a
    dataset that is not of `plan`.
    """
    if "velocity_ref_rad_s" not in motion or len(motion["time"]) < 2:
        raise InputError("motion: expected a dataset of plan, with velocity_ref_rad_s")
    step = float(motion["time"][1] - motion["time"][0])
    design = {"kind": "path"} | dict(motion.attrs)
    return References(step, motion["velocity_ref_rad_s"].values[np.newaxis], design=design)


def _bounds(robot: Robot, limits: Limits) -> dict[str, Any]:
    """Return limits per motor (n_axes,); None for torque without a limit."""
    found: dict[str, Any] = {}
    for name in ("velocity_rad_s", "acceleration_rad_s2", "torque_nm"):
        value = getattr(limits, name)
        key = name.split("_")[0]
        if value is None and key != "torque":
            raise InputError(f"limits.{name}: expected a number or one per axis, got None")
        found[key] = None if value is None else per_item(name, value, robot.n_axes)
        if value is not None and not (found[key] > 0).all():
            raise InputError(f"limits.{name}: expected positive numbers, got {value}")
    return found


class _Torques:
    """Motor torques along a path, with all other joints as they rest at its start."""

    def __init__(self, robot: Robot, path: JointPath) -> None:
        self.robot, self.path = robot, path
        start = np.asarray(path.curve(0.0))
        self.rest = robot.equilibrium(start.tolist())["joint_angle_rad"].values.astype(float)
        known = robot.parameters()
        names = [robot.joint_names[j] for j in robot.axis_joints]
        self.inertia = np.array([known[f"{name}.motor_inertia"] for name in names])
        self.viscous = np.array([known[f"{name}.viscous_friction"] for name in names])

    def without_friction(self, q: Real, v: Real, a: Real) -> Real:
        """Return motor torques [Nm] (n, n_axes) for positions, speeds, accelerations of the driven joints."""
        joints = [np.tile(self.rest, (len(q), 1)), *np.zeros((2, len(q), self.robot.n_joints))]
        for joint, driven in zip(joints, (q, v, a), strict=True):
            joint[:, self.robot.axis_joints] = driven
        load = self.robot.inverse_dynamics(*joints)[:, self.robot.axis_joints]
        ratio = self.robot.gear_ratio
        return np.asarray(self.inertia * a / ratio + ratio * load)

    def of(self, q: Real, v: Real, a: Real) -> Real:
        """Return the same with viscous friction."""
        return self.without_friction(q, v, a) + self.viscous * v / self.robot.gear_ratio


def _check_static(robot: Robot, torques: _Torques, grid: Real, bound: Real) -> None:
    angle = torques.path.curve(grid)
    held = np.abs(torques.without_friction(angle, 0 * angle, 0 * angle)).max(axis=0)
    for axis in np.flatnonzero(held >= (1 - _MARGIN) * bound):
        name = robot.axis_names[axis]
        raise InputError(
            f"limits.torque_nm: joint {name}: expected more than the {held[axis]:.4g} Nm that holds the robot "
            f"along the path, got {bound[axis]:.4g} Nm"
        )


def _time_law(
    robot: Robot,
    path: JointPath,
    grid: Real,
    bound: dict[str, Any],
    torques: _Torques,
    reserve: Real,
) -> Any:
    """Return the fastest trajectory that TOPP-RA finds; ``reserve`` (n_axes,) [Nm] is kept of the torque."""
    toppra = _toppra()
    ratio, kept = np.abs(robot.gear_ratio), 1.0 - _MARGIN
    both = np.array([-1.0, 1.0])
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.outer(kept * ratio * bound["velocity"], both)),
        toppra.constraint.JointAccelerationConstraint(
            np.outer(kept * ratio * bound["acceleration"], both)
        ),
    ]
    if bound["torque"] is not None:

        def torque(q: Real, v: Real, a: Real) -> Real:
            return np.asarray(torques.without_friction(q[None], v[None], a[None])[0])

        left = np.maximum(kept * bound["torque"] - reserve, 0.0)
        limit = np.outer(left, both)
        constraints.append(
            toppra.constraint.JointTorqueConstraint(torque, limit, np.zeros(robot.n_axes))
        )
    points = toppra.SplineInterpolator(grid, path.curve(grid))
    planner = toppra.algorithm.TOPPRA(
        constraints, points, gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    law = planner.compute_trajectory()
    if law is None:
        raise InputError(
            "limits: no motion along the path keeps them. Expected more torque or acceleration, "
            "or a path without sharp bends"
        )
    return law


def _toppra() -> Any:
    try:
        toppra = import_module("toppra")
        import_module("toppra.algorithm")
        import_module("toppra.constraint")
    except ImportError as error:
        raise MissingExtraError('plan needs toppra: pip install "axisight[paths]"') from error
    toppra.setup_logging("ERROR")
    return toppra


def _sampled(robot: Robot, torques: _Torques, law: Any) -> xr.Dataset:
    """Return the motion at the controller's samples, the last of them at rest."""
    step = robot.sample_time_s
    time = np.arange(int(np.ceil(law.duration / step)) + 1) * step
    at = np.minimum(time, law.duration)
    q, v, a = (np.asarray(law(at, order)) for order in range(3))
    v[time > law.duration], a[time > law.duration] = 0.0, 0.0
    ratio = robot.gear_ratio
    position = q / ratio
    held = np.diff(position, axis=0, append=position[-1:]) / step
    units = {
        "joint_position_rad": (q, "rad"),
        "position_ref_rad": (position, "rad"),
        "velocity_ref_rad_s": (held, "rad/s"),
        "acceleration_rad_s2": (a / ratio, "rad/s^2"),
        "torque_nm": (torques.of(q, v, a), "Nm"),
    }
    return xr.Dataset(
        {name: (("time", "axis"), x, {"units": unit}) for name, (x, unit) in units.items()},
        coords={"time": ("time", time, {"units": "s"}), "axis": robot.axis_numbers()},
    )


def _largest_share(motion: xr.Dataset, bound: dict[str, Any]) -> tuple[float, str]:
    """Return the largest share of a limit that the motion takes [1], and the name of that limit with its axis."""
    names = ("velocity_ref_rad_s", "acceleration_rad_s2", "torque_nm")
    found = {
        what: np.abs(motion[name].values).max(axis=0) / limit
        for name, (what, limit) in zip(names, bound.items(), strict=True)
        if limit is not None
    }
    what = max(found, key=lambda name: float(found[name].max()))
    axis = int(np.argmax(found[what]))
    return float(found[what][axis]), f"the {what} limit of axis {axis + 1}"
