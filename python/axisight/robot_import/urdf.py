"""Read URDF: links, joints and drives; meshes are never opened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.arguments import shown
from axisight.errors import RobotError
from axisight.robot import JointLimits
from axisight.robot_import.bodies import Body, Drive, Mass, Motion, Pose, Tree, mimics, still
from axisight.robot_import.urdf_transmissions import gear_ratios
from axisight.robot_import.xml_tree import Element

Array = NDArray[np.float64]

_MOTIONS: dict[str, Motion] = {
    "fixed": "fixed",
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "floating": "other",
    "planar": "other",
}
_XACRO = "xacro:"


def read_urdf(root: Element, path: Path) -> Tree:
    """Return the bodies of a URDF file from its root element; raise RobotError naming file, line, element."""
    unrun = next((e for e in root.walk() if e.tag.startswith(_XACRO)), None)
    if unrun is not None:
        raise RobotError(
            f"{unrun.where}: expected URDF, got xacro: run `xacro {path.name} > robot.urdf` first"
        )
    links = _named(root, "link")
    if not links:
        raise RobotError(f"{root.where}: expected at least one <link>, got none")
    joints = _named(root, "joint")
    ratios, notes = gear_ratios(root, joints)
    above = _above(joints, links)
    order = _from_the_root(root, links, above)
    bodies = {
        name: _body(name, links[name], above.get(name), ratios, links, notes) for name in order
    }
    return Tree(root.attributes.get("name", path.stem), bodies, str(path), notes=notes)


def _named(root: Element, tag: str) -> dict[str, Element]:
    """Return the elements of a tag by name; raise RobotError if two share a name."""
    out: dict[str, Element] = {}
    for element in root.all(tag):
        name = element.require("name", f"the name of the {tag}")
        if name in out:
            raise RobotError(
                f"{element.where}: expected a name no other {tag} has, got that of line {out[name].line}"
            )
        out[name] = element
    return out


def _end(joint: Element, tag: str, links: dict[str, Element]) -> str:
    """Return the link that a joint names as its parent or child (``tag``); raise RobotError without it."""
    end = joint.find(tag)
    if end is None:
        raise RobotError(f"{joint.where}: expected <{tag} link=...>, got none")
    name = end.require("link", f"the {tag} of joint {joint.attributes['name']!r}")
    if name not in links:
        raise RobotError(f"{end.where}: expected the name of a link, got {shown(name)}")
    return name


def _above(joints: dict[str, Element], links: dict[str, Element]) -> dict[str, Element]:
    """Return the joint that moves each link; raise RobotError if two joints move one link (closed loop)."""
    seen: dict[str, Element] = {}
    for joint in joints.values():
        child = _end(joint, "child", links)
        if child in seen:
            other = seen[child].attributes["name"]
            raise RobotError(
                f"{joint.where}: expected a tree, got a closed loop: {child!r} is the child of {other!r} too"
            )
        seen[child] = joint
    return seen


def _from_the_root(
    root: Element, links: dict[str, Element], above: dict[str, Element]
) -> list[str]:
    """Return the links, parents before children; raise RobotError unless they form one tree."""
    free = [name for name in links if name not in above]
    if len(free) != 1:
        got = "none, a closed loop" if not free else f"{len(free)}: {', '.join(free[:10])}"
        raise RobotError(f"{root.where}: expected one link that no joint moves, got {got}")
    below: dict[str, list[str]] = {}
    for child, joint in above.items():
        below.setdefault(_end(joint, "parent", links), []).append(child)
    order: list[str] = []
    todo = free
    while todo:
        name = todo.pop()
        order.append(name)
        todo += reversed(below.get(name, []))
    lost = [name for name in links if name not in set(order)]
    if lost:
        raise RobotError(
            f"{above[lost[0]].where}: expected a tree, got a closed loop of {', '.join(lost[:10])}"
        )
    return order


def _body(
    name: str,
    link: Element,
    joint: Element | None,
    ratios: dict[str, float],
    links: dict[str, Element],
    notes: list[str],
) -> Body:
    mass = _mass(link, notes)
    if joint is None:
        return Body(name, None, "", "fixed", still(), np.zeros(3), mass, link.where)
    kind = joint.require("type", f"one of {', '.join(_MOTIONS)}")
    if kind not in _MOTIONS:
        raise RobotError(
            f"{joint.where}: type: expected one of {', '.join(_MOTIONS)}, got {shown(kind)}"
        )
    motion = _MOTIONS[kind]
    refused = ""
    if motion == "other":
        refused = (
            f"expected revolute, continuous, prismatic or fixed joints between base and tip, got "
            f"type {kind!r}: choose them beyond it by --base and --tip"
        )
    mimic = joint.find("mimic")
    if mimic is not None:
        refused = mimics(mimic.attributes.get("joint", "?"))
    return Body(
        name,
        _end(joint, "parent", links),
        joint.attributes["name"],
        motion,
        _pose(joint.find("origin")),
        _axis(joint) if motion in ("revolute", "prismatic") else np.zeros(3),
        mass,
        joint.where,
        _drive(joint, ratios.get(joint.attributes["name"], 1.0)),
        _limits(joint, kind),
        refused,
        follows="" if mimic is None else mimic.attributes.get("joint", "?"),
        is_free=kind == "floating",
    )


def _pose(origin: Element | None) -> Pose:
    """Return the pose of <origin>: roll, pitch and yaw [rad] about fixed axes; identity without it."""
    if origin is None:
        return still()
    roll, pitch, yaw = origin.numbers("rpy", 3, (0.0, 0.0, 0.0))
    position = origin.numbers("xyz", 3, (0.0, 0.0, 0.0))
    turned = scipy.spatial.transform.Rotation.from_euler("xyz", [roll, pitch, yaw])
    return Pose(turned.as_matrix(), np.array(position))


def _axis(joint: Element) -> Array:
    element = joint.find("axis")
    if element is None:
        return np.array([1.0, 0.0, 0.0])
    axis = np.array(element.numbers("xyz", 3))
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        raise RobotError(f"{element.where}: xyz: expected a direction, got {axis.tolist()}")
    return axis / length


# Negative moments down to this size, or this share of the largest, are rounding errors of the exporting tool.
# A milligram at a distance of one millimetre has a thousand times as much.
_ROUNDING_KG_M2 = 1e-15
_ROUNDING = 1e-12


def _mass(link: Element, notes: list[str]) -> Mass | None:
    """Return the mass of <inertial>, None without it; raise RobotError for negative masses or moments.

    Moments that are negative by a rounding error become zero, with an entry in ``notes``.
    """
    inertial = link.find("inertial")
    if inertial is None:
        return None
    masses, inertias = inertial.find("mass"), inertial.find("inertia")
    if masses is None or inertias is None:
        missing = "mass" if masses is None else "inertia"
        raise RobotError(f"{inertial.where}: expected <{missing}>, got none")
    mass = masses.number("value")
    xx, yy, zz = (inertias.number(name) for name in ("ixx", "iyy", "izz"))
    xy, xz, yz = (inertias.number(name, 0.0) for name in ("ixy", "ixz", "iyz"))
    if mass < 0:
        raise RobotError(f"{masses.where}: value: expected a mass of zero or more, got {mass:g} kg")
    for name, value in zip(("ixx", "iyy", "izz"), (xx, yy, zz), strict=True):
        if value < -max(_ROUNDING_KG_M2, _ROUNDING * max(xx, yy, zz)):
            raise RobotError(
                f"{inertias.where}: {name}: expected zero or more, got {value:g} kg m^2"
            )
        if value < 0:
            notes.append(
                f"{name} of link {link.attributes['name']!r} taken as zero: {value:g} kg m^2 in line {inertias.line}"
            )
    xx, yy, zz = (max(value, 0.0) for value in (xx, yy, zz))
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pose = _pose(inertial.find("origin"))
    return Mass(mass, np.zeros(3), matrix).at(pose)


def _drive(joint: Element, ratio: float) -> Drive:
    dynamics, limit = joint.find("dynamics"), joint.find("limit")
    effort = 0.0 if limit is None else limit.number("effort", 0.0)
    if dynamics is None:
        return Drive(gear_ratio=ratio, effort=effort)
    found = {name: dynamics.number(name, 0.0) for name in ("damping", "friction")}
    for name, value in found.items():
        if value < 0:
            raise RobotError(f"{dynamics.where}: {name}: expected zero or more, got {value:g}")
    return Drive(ratio, damping=found["damping"], friction=found["friction"], effort=effort)


def _limits(joint: Element, kind: str) -> JointLimits:
    """Return the limits of a joint; a speed or an effort of zero or none states no limit."""
    limit = joint.find("limit")
    if limit is None:
        return JointLimits()
    effort = limit.number("effort", 0.0)
    return JointLimits(
        None if kind == "continuous" else _range(limit),
        velocity=_speed(limit),
        effort=effort if effort > 0 else None,
    )


def _range(limit: Element) -> tuple[float, float] | None:
    lower, upper = limit.number("lower", 0.0), limit.number("upper", 0.0)
    if lower > upper:
        raise RobotError(f"{limit.where}: expected lower <= upper, got {lower:g} and {upper:g}")
    return None if lower == upper else (lower, upper)


def _speed(limit: Element) -> float | None:
    # Some tools write an infinite speed for a joint without a limit.
    if limit.attributes.get("velocity", "").strip().lstrip("+").lower() in ("inf", "infinity"):
        return None
    speed = limit.number("velocity", 0.0)
    return speed if speed > 0 else None
