"""Motions in all coordinates: six of a floating base, then the joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError
from axisight.rigid_body.regressor import rows
from axisight.robot import BaseMotion, Robot

Array = NDArray[np.float64]


def floating_motion(
    robot: Robot, q: ArrayLike, v: ArrayLike, a: ArrayLike, base: BaseMotion
) -> tuple[Array, Array, Array]:
    """Return a motion (n, 6 + n_joints) in all coordinates, for `TorqueModel` and `identify_rigid_body`.

    ``q``, ``v``, ``a`` are those of the joints, (n, n_joints), ``base`` has n rows. The coordinates of the base are
    three shifts along its axes and three turns about them, which begin anew at zero in every sample. The rates are
    (0, w) with the angular velocity w. The accelerations are the proper acceleration, and the angular acceleration
    minus ``(w_y w_z, -w_x w_z, w_x w_y)``: turns about x carry the axes y and z, and turns about y the axis z.

    Raises InputError for a robot with a fixed base, other shapes and numbers that are not finite.
    """
    if robot.floating_base is None:
        raise InputError(f"robot: expected a floating base, got {robot.name!r} with a fixed one")
    joints = [rows(name, x, robot.n_joints) for name, x in (("q", q), ("v", v), ("a", a))]
    rate, growth, proper = base.parts()
    for name, array in (("v", joints[1]), ("a", joints[2]), ("base", rate)):
        if len(array) != len(joints[0]):
            raise InputError(f"{name}: expected {len(joints[0])} rows as q, got {len(array)}")
    x, y, z = rate.T
    carried = np.stack([y * z, -x * z, x * y], axis=1)
    nothing = np.zeros_like(rate)
    return (
        np.hstack([nothing, nothing, joints[0]]),
        np.hstack([nothing, rate, joints[1]]),
        np.hstack([proper, growth - carried, joints[2]]),
    )
