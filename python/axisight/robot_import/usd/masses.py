"""Masses of USD bodies, as MassAPI and NewtonMassAPI state them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import RobotError
from axisight.robot_import.bodies import Mass
from axisight.robot_import.usd.attributes import Units, authored
from axisight.robot_import.usd.frames import rotation
from axisight.robot_import.usd.stage import pxr

Array = NDArray[np.float64]

FULL_INERTIA = "newton:inertia"
"""Inertia as six numbers (xx, yy, zz, xy, xz, yz), which replaces the principal moments."""


def mass_of(prim: Any, where: str, units: Units, scale: Array) -> Mass | None:
    """Return the mass of a body in its own frame; None if the body states none and has no shapes.

    ``scale`` (3,) is that of the body. Raises RobotError if mass or inertia would follow from shapes, and for
    negative values.
    """
    api = pxr("UsdPhysics").MassAPI(prim)
    mass = float(api.GetMassAttr().Get() or 0.0) if api else 0.0
    if mass < 0:
        raise RobotError(f"{where}: physics:mass: expected a mass of zero or more, got {mass:g}")
    inertia = _inertia(prim, api, where) if api else None
    if mass == 0 or inertia is None:
        if mass == 0 and inertia is None and not _has_shapes(prim):
            return None
        missing = "physics:mass" if mass == 0 else "physics:diagonalInertia"
        raise RobotError(
            f"{where}: expected {missing} of the body in MassAPI, got none: masses of shapes are not computed; "
            f"write the masses that your simulator computes into the bodies"
        )
    com = np.array(api.GetCenterOfMassAttr().Get() or (0.0, 0.0, 0.0), dtype=np.float64)
    # USD's default, minus infinity, leaves the centre to the shapes.
    if not np.all(np.isfinite(com)):
        if _has_shapes(prim):
            raise RobotError(
                f"{where}: expected physics:centerOfMass of the body in MassAPI, got none: it is not computed "
                f"from shapes"
            )
        com = np.zeros(3)
    return Mass(
        mass * units.mass_kg,
        com * scale * units.length_m,
        inertia * units.mass_kg * units.length_m**2,
    )


def _inertia(prim: Any, api: Any, where: str) -> Array | None:
    """Return the inertia (3, 3) of a body in units of the stage; None if the body states none."""
    full = authored(prim, FULL_INERTIA)
    if full is not None and len(full) == 6:
        xx, yy, zz, xy, xz, yz = (float(x) for x in full)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = np.array(api.GetDiagonalInertiaAttr().Get() or (0.0, 0.0, 0.0), dtype=np.float64)
    if np.any(moments < 0):
        raise RobotError(
            f"{where}: physics:diagonalInertia: expected zero or more, got {moments.tolist()}"
        )
    if not np.any(moments):
        return None
    axes = api.GetPrincipalAxesAttr().Get()
    turned = np.eye(3) if axes is None else rotation(axes)
    return np.asarray(turned @ np.diag(moments) @ turned.T)


def _has_shapes(prim: Any) -> bool:
    """Whether a body has collision shapes, bodies below it not counted."""
    physics, usd = pxr("UsdPhysics"), pxr("Usd")
    below = iter(usd.PrimRange(prim, usd.TraverseInstanceProxies()))
    for child in below:
        if child != prim and child.HasAPI(physics.RigidBodyAPI):
            below.PruneChildren()
        elif child.HasAPI(physics.CollisionAPI):
            return True
    return False
