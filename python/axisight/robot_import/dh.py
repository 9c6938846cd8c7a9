"""Tables of Denavit and Hartenberg, standard and modified, as CSV."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from axisight.arguments import shown
from axisight.errors import RobotError
from axisight.robot_import.bodies import Body, Mass, Motion, Pose, Tree, still

Array = NDArray[np.float64]

CONVENTIONS = ("standard", "modified")
_GEOMETRY = ("theta_rad", "d_m", "a_m", "alpha_rad")
_COM = ("com_x_m", "com_y_m", "com_z_m")
_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
COLUMNS = ("joint", "convention", "motion", *_GEOMETRY, "mass_kg", *_COM, *_INERTIA)
"""Columns of a table, in any order; ``motion`` may be left out, and products of inertia."""
_OPTIONAL = {"motion": "revolute", "ixy": "0", "ixz": "0", "iyz": "0"}


def read_dh(path: Path) -> Tree:
    """Return the bodies of a table; raises RobotError naming file, line and column.

    A row says a joint and its link: ``theta``, ``d``, ``a``, ``alpha`` at joint angle zero, mass, centre of
    mass and inertia about it [kg m^2] in the frame of the row. ``convention`` is ``standard`` (the joint turns
    about z of the frame before; Denavit and Hartenberg 1955) or ``modified`` (about z of its own; Craig 1986).
    """
    rows = _rows(path)
    bodies = {"base": Body("base", None, "", "fixed", still(), np.zeros(3), None, str(path))}
    parent = "base"
    for line, row in rows:
        where = f"{path}, line {line}, joint {row['joint']!r}"
        for one in _bodies(row, parent, where):
            bodies[one.name] = one
            parent = one.name
    return Tree(path.stem, bodies, str(path))


def _rows(path: Path) -> list[tuple[int, dict[str, str]]]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            lines = [(n, x) for n, x in enumerate(file, start=1) if not x.startswith("#")]
        reader = csv.DictReader(text for _, text in lines)
        # The reader counts what it gets, and comments are none of it.
        found = [(lines[reader.line_num - 1][0], row) for row in reader]
        names = reader.fieldnames or []
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RobotError(f"{path}: expected a readable table: {error}") from error
    unknown = [name for name in names if name not in COLUMNS]
    missing = [name for name in COLUMNS if name not in names and name not in _OPTIONAL]
    if unknown or missing:
        said = f"unknown {', '.join(map(str, unknown))}" if unknown else f"no {', '.join(missing)}"
        raise RobotError(
            f"{path}, line {lines[0][0] if lines else 1}: expected the columns {', '.join(COLUMNS)}, got {said}"
        )
    rows = [(n, {**_OPTIONAL, **{k: v.strip() for k, v in r.items() if k and v}}) for n, r in found]
    seen: set[str] = set()
    for number, row in rows:
        name = row.get("joint", "")
        if not name or name in seen:
            raise RobotError(
                f"{path}, line {number}: joint: expected a name no other row has, got {shown(name)}"
            )
        seen.add(name)
    return rows


def _bodies(row: dict[str, str], parent: str, where: str) -> list[Body]:
    """Return the joint of a row and, in the standard convention, the frame at the end of its link."""
    convention, motion = row.get("convention", ""), row["motion"]
    if convention not in CONVENTIONS:
        expected = " or ".join(CONVENTIONS)
        raise RobotError(f"{where}: convention: expected {expected}, got {shown(convention)}")
    if motion not in ("revolute", "prismatic"):
        raise RobotError(f"{where}: motion: expected revolute or prismatic, got {shown(motion)}")
    theta, d, a, alpha = (_number(row, name, where) for name in _GEOMETRY)
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
    xx, yy, zz, xy, xz, yz = (_number(row, name, where) for name in _INERTIA)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Mass(mass, np.array([_number(row, name, where) for name in _COM]), inertia)


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
    return Pose(Rotation.from_euler(about, angle).as_matrix(), np.zeros(3))
