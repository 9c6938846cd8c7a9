"""Frames of USD prims: poses of joints in the bodies that they connect, units applied."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from axisight.robot_import.bodies import Pose, still
from axisight.robot_import.usd.stage import pxr

Array = NDArray[np.float64]


def body_above(prim: Any) -> Any | None:
    """Return the rigid body that a prim is or belongs to; None if it belongs to the world."""
    physics = pxr("UsdPhysics")
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(physics.RigidBodyAPI):
            enabled = physics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get()
            return None if enabled is False else prim
        prim = prim.GetParent()
    return None


class Frames:
    """World frames of the prims of a stage."""

    def __init__(self, length_m: float) -> None:
        self.length_m = length_m
        self._cache = pxr("UsdGeom").XformCache()

    def scale(self, prim: Any) -> Array:
        """Return the scale (3,) of a prim's frame in the world."""
        return np.asarray(np.linalg.norm(self._matrix(prim)[:3, :3], axis=1))

    def world(self, prim: Any) -> Pose:
        """Return the pose of a prim in the world [m]."""
        matrix = self._matrix(prim)
        # USD multiplies rows from the left, so the axes of the frame are the rows.
        turned = Rotation.from_matrix((matrix[:3, :3] / self.scale(prim)[:, None]).T)
        return Pose(turned.as_matrix(), matrix[3, :3] * self.length_m)

    def of_joint(self, holder: Any | None, body: Any | None, place: Any, turned: Any) -> Pose:
        """Return the pose of a joint frame in a body, or in the world without one.

        ``holder`` is the prim in whose space ``place`` and the quaternion ``turned`` are; None: the world.
        """
        at = np.asarray(place, dtype=np.float64)
        if holder is None:
            return Pose(rotation(turned), at * self.length_m)
        own = Pose(rotation(turned), at * self.scale(holder) * self.length_m)
        if body is not None and holder.GetPath() == body.GetPath():
            return own
        outer = still() if body is None else self.world(body).inverse()
        return outer @ self.world(holder) @ own

    def _matrix(self, prim: Any) -> Array:
        return np.asarray(self._cache.GetLocalToWorldTransform(prim), dtype=np.float64)


def rotation(quaternion: Any) -> Array:
    """Return the rotation (3, 3) of a USD quaternion; one of length zero is no rotation."""
    x, y, z = quaternion.GetImaginary()
    four = np.array([x, y, z, quaternion.GetReal()], dtype=np.float64)
    if not np.any(four):
        return np.eye(3)
    return np.asarray(Rotation.from_quat(four).as_matrix())
