"""Read tables of Denavit and Hartenberg, in the standard and the modified convention."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.arguments import shown
from axisight.errors import RobotError
from axisight.robot_import.bodies import Body, Mass, Motion, Pose, Tree, still
from axisight.robot_import.dh_rows import COM, CONVENTIONS, GEOMETRY, INERTIA, rows_of

Array = NDArray[np.float64]


def read_dh(path: Path) -> Tree:
    """Return the bodies of a table; raise RobotError naming file, line or joint, and column.

    A row states a joint and its link: ``theta``, ``d``, ``a`` and ``alpha`` at joint angle zero [rad, m],
    mass [kg], centre of mass [m] and inertia about it [kg m^2] in the frame of the row. With ``convention``
    ``standard`` the joint turns about z of the previous frame (Denavit and Hartenberg 1955), with
    ``modified`` about z of its own frame (Craig 1986).
    """
    bodies = {"base": Body("base", None, "", "fixed", still(), np.zeros(3), None, str(path))}
    parent = "base"
    for where, row in rows_of(path):
        for one in _bodies(row, parent, where):
            bodies[one.name] = one
            parent = one.name
    return Tree(path.stem, bodies, str(path))


def _bodies(row: dict[str, str], parent: str, where: str) -> list[Body]:
    """Return the bodies of a row: joint and link, in the modified convention as one body."""
    convention, motion = row.get("convention", ""), row["motion"]
    if convention not in CONVENTIONS:
        expected = " or ".join(CONVENTIONS)
        raise RobotError(f"{where}: convention: expected {expected}, got {shown(convention)}")
    if motion not in ("revolute", "prismatic"):
        raise RobotError(f"{where}: motion: expected revolute or prismatic, got {shown(motion)}")
    theta, d, a, alpha = (_number(row, name, where) for name in GEOMETRY)
    mass = _mass(row, where)
    along_z = _turned("z", theta) @ Pose(np.eye(3), np.array([0.0, 0.0, d]))
    along_x = _turned("x", alpha) @ Pose(np.eye(3), np.array([a, 0.0, 0.0]))
    axis, name = np.array([0.0, 0.0, 1.0]), row["joint"]
    kind: Motion = "prismatic" if motion == "prismatic" else "revolute"
    if convention == "modified":
        return [Body(name, parent, name, kind, along_x @ along_z, axis, mass, where)]
    joint = Body(f"{name} joint", parent, name, kind, still(), axis, None, where, of=name)
    link = Body(name, joint.name, "", "fixed", along_z @ along_x, np.zeros(3), mass, where)
    return [joint, link]


def _mass(row: dict[str, str], where: str) -> Mass:
    mass = _number(row, "mass_kg", where)
    if mass <= 0:
        raise RobotError(f"{where}: mass_kg: expected a positive mass, got {mass:g}")
    xx, yy, zz, xy, xz, yz = (_number(row, name, where) for name in INERTIA)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Mass(mass, np.array([_number(row, name, where) for name in COM]), inertia)


def _number(row: dict[str, str], name: str, where: str) -> float:
    text = row.get(name, "")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RobotError(f"{where}: {name}: expected a number, got {shown(text)}")
    return value


def _turned(about: str, angle: float) -> Pose:
    return Pose(scipy.spatial.transform.Rotation.from_euler(about, angle).as_matrix(), np.zeros(3))
