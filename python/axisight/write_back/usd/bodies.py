"""Masses and frames of USD bodies: MassAPI, and the frames of joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from axisight.robot import Robot
from axisight.robot_import.bodies import Pose
from axisight.robot_import.chain import Chain
from axisight.robot_import.usd import UsdModel
from axisight.robot_import.usd.attributes import authored
from axisight.robot_import.usd.frames import Frames, body_above
from axisight.robot_import.usd.masses import FULL_INERTIA
from axisight.robot_import.usd.reader import Link
from axisight.robot_import.usd.stage import pxr
from axisight.write_back.frames import moved, moves_of
from axisight.write_back.links import BodyChange
from axisight.write_back.placed import Placed, said
from axisight.write_back.usd.layer import Overlay, cannot_change

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

Array = NDArray[np.float64]

_ENTRIES = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])


def write_bodies(overlay: Overlay, model: UsdModel, changes: Sequence[BodyChange]) -> Placed:
    """Write changed bodies; return what was written, and why the rest was not."""
    placed, frames = Placed(), Frames(model.units.length_m)
    for change in changes:
        prim = model.bodies[change.body]
        if why := cannot_change(prim):
            placed.refuse(change.causes, f"{change.body!r}: {why}")
            continue
        _write_mass(overlay, prim, model, change, frames.scale(prim))
        placed.take(change.causes)
    return placed


def _write_mass(
    overlay: Overlay, prim: Any, model: UsdModel, change: BodyChange, scale: Array
) -> None:
    gf, units, after = pxr("Gf"), model.units, change.after
    place = after.com_m / units.length_m / scale
    inertia = after.inertia_kg_m2 / units.mass_kg / units.length_m**2
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0:
        axes = -axes
    turned = _quaternion(axes)
    overlay.set(prim, "physics:mass", after.mass_kg / units.mass_kg, "float", said(change.causes))
    overlay.set(prim, "physics:centerOfMass", gf.Vec3f(*place.tolist()), "point3f")
    overlay.set(prim, "physics:diagonalInertia", gf.Vec3f(*moments.tolist()), "float3")
    overlay.set(prim, "physics:principalAxes", turned, "quatf")
    if authored(prim, FULL_INERTIA) is not None:
        overlay.set(prim, FULL_INERTIA, inertia[_ENTRIES].tolist(), "double[]")


def write_frames(
    overlay: Overlay, model: UsdModel, chain: Chain, robot: Robot, causes: Sequence[Cause]
) -> Placed:
    """Write causes that change the frames of joints, in the bodies that carry them."""
    moves, placed = moves_of(robot, causes)
    frames = Frames(model.units.length_m)
    for at, move in moves.items():
        link = model.joints[chain.joints[at].body.joint]
        holder, why = _holder(model, link)
        if why:
            placed.refuse(move.causes, why)
            continue
        pose = moved(model.tree, chain, at, move)
        scale = np.ones(3) if holder is None else frames.scale(holder)
        _write_frame(overlay, model, link, pose, scale, said(move.causes))
        placed.take(move.causes)
    return placed


def _holder(model: UsdModel, link: Link) -> tuple[Any | None, str]:
    """Return the prim in whose space the frame of a joint stands, and why it cannot be changed."""
    side = 1 if link.flipped else 0
    targets = link.prim.GetRelationship(f"physics:body{side}").GetTargets()
    holder = model.stage.GetPrimAtPath(targets[0]) if targets else None
    why = cannot_change(link.prim)
    if not why and holder is not None and body_above(holder) != holder:
        why = f"expected a joint that names its body, got {holder.GetPath()}"
    return holder, why


def _write_frame(
    overlay: Overlay, model: UsdModel, link: Link, pose: Pose, scale: Array, comment: str
) -> None:
    gf, side = pxr("Gf"), 1 if link.flipped else 0
    place = pose.origin / model.units.length_m / scale
    overlay.set(link.prim, f"physics:localPos{side}", gf.Vec3f(*place.tolist()), "point3f", comment)
    overlay.set(link.prim, f"physics:localRot{side}", _quaternion(pose.rotation), "quatf")


def _quaternion(turned: Array) -> Any:
    """Return a rotation (3, 3) as a USD quaternion."""
    x, y, z, w = Rotation.from_matrix(turned).as_quat().tolist()
    return pxr("Gf").Quatf(w, x, y, z)
