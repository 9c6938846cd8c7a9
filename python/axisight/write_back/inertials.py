"""Masses of bodies in the text of a URDF or MJCF."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.robot_import.xml_tree import Element
from axisight.write_back.links import BodyChange
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits

Array = NDArray[np.float64]

# Attributes by which MJCF states the axes of an inertia.
_AXES = ("diaginertia", "quat", "axisangle", "xyaxes", "zaxis", "euler")
_ENTRIES = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
_NAMES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def write_bodies(edits: Edits, root: Element, changes: Sequence[BodyChange]) -> Placed:
    """Write changed bodies; return what was written, and why the rest was not."""
    placed = Placed()
    tag = "link" if root.tag == "robot" else "body"
    bodies = {e.attributes.get("name"): e for e in root.walk() if e.tag == tag}
    for change in changes:
        body = bodies.get(change.body)
        write = _urdf if root.tag == "robot" else _mjcf
        why = (
            f"{change.body!r} stands in another file or has no name"
            if body is None
            else write(edits, root, body, change)
        )
        if why:
            placed.refuse(change.causes, why)
        else:
            placed.take(change.causes)
    return placed


def _mjcf(edits: Edits, root: Element, body: Element, change: BodyChange) -> str:
    """Set or add <inertial>; return why that failed, else empty."""
    for compiler in (e for e in root.walk() if e.tag == "compiler"):
        for name, usual in (("inertiafromgeom", "auto"), ("settotalmass", "-1")):
            if compiler.attributes.get(name, usual) not in (usual, "false"):
                return f"the compiler option {name} makes masses of its own"
    before, after = change.before, change.after
    numbers = {
        "pos": after.com_m.tolist(),
        "mass": after.mass_kg,
        "fullinertia": after.inertia_kg_m2[_ENTRIES].tolist(),
    }
    own = body.find("inertial")
    if own is None:
        edits.add(body, "inertial", numbers, f"{said(change.causes)}; in place of its geoms")
        return ""
    if not _differ(before.com_m, after.com_m):
        del numbers["pos"]
    turned: tuple[str, ...] = _AXES
    if not _differ(before.inertia_kg_m2, after.inertia_kg_m2):
        del numbers["fullinertia"]
        turned = ()
    edits.set(own, numbers, said(change.causes), without=turned)
    return ""


def _urdf(edits: Edits, root: Element, link: Element, change: BodyChange) -> str:
    """Set the values in <inertial>; the inertia's frame keeps its rotation."""
    del root
    own = link.find("inertial")
    masses, inertias = (None if own is None else own.find(t) for t in ("mass", "inertia"))
    assert own is not None  # A body without <inertial> has no mass to change.
    assert masses is not None
    assert inertias is not None
    origin, after = own.find("origin"), change.after
    edits.set(masses, {"value": after.mass_kg}, said(change.causes))
    if _differ(change.before.com_m, after.com_m):
        place = {"xyz": after.com_m.tolist()}
        if origin is None:
            edits.add(own, "origin", place)
        else:
            edits.set(origin, place)
    if _differ(change.before.inertia_kg_m2, after.inertia_kg_m2):
        angles = (0.0, 0.0, 0.0) if origin is None else origin.numbers("rpy", 3, (0.0, 0.0, 0.0))
        turned = scipy.spatial.transform.Rotation.from_euler("xyz", angles).as_matrix()
        inside = turned.T @ after.inertia_kg_m2 @ turned
        edits.set(inertias, dict(zip(_NAMES, inside[_ENTRIES].tolist(), strict=True)))
    return ""


def _differ(before: Array, after: Array) -> bool:
    size = float(np.abs(before).max() + np.abs(after).max())
    return bool(np.abs(after - before).max() > 1e-10 * size)
