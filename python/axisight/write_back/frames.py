"""Positions of axes in the text of a URDF or MJCF: link lengths, joint zeros, tilt of the base.

Link frames are parallel to the base frame at zero angles. Frames of the file may be rotated: vectors are
transformed to the frame of the body that contains the element.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from axisight.effects.stated import BASE_TILT, JOINT_ZERO, LINK_GEOMETRY
from axisight.robot import Robot
from axisight.robot_import.bodies import Pose, Tree
from axisight.robot_import.chain import Chain
from axisight.robot_import.xml_tree import Element
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

Array = NDArray[np.float64]

FRAME_EFFECTS = (LINK_GEOMETRY, JOINT_ZERO[0], BASE_TILT)


@dataclass
class Move:
    """Change of a joint of the chain: its position shifted [m] and everything rotated, in the base frame.

    ``turned``: rotation of what the joint stands on. ``zero_rad``: change of the joint's zero.
    """

    shift_m: Array = field(default_factory=lambda: np.zeros(3))
    turned: Rotation = field(default_factory=Rotation.identity)
    zero_rad: float = 0.0
    causes: list[Cause] = field(default_factory=list)


def write_frames(
    edits: Edits,
    root: Element,
    model: tuple[Tree, Chain],
    robot: Robot,
    causes: Sequence[Cause],
) -> Placed:
    """Write causes that change frames; return what was written, and why the rest was not.

    ``model``: the tree of the file and its chain.
    """
    placed = Placed()
    urdf = root.tag == "robot"
    tilts = [] if urdf else [cause for cause in causes if cause.effect == BASE_TILT]
    for cause in tilts:
        _done(placed, [cause], _gravity(edits, root, model[1], cause))
    moves, behind = moves_of(robot, [cause for cause in causes if cause not in tilts])
    for at, move in moves.items():
        write = _urdf if urdf else _mjcf
        _done(placed, move.causes, write(edits, root, model, at, move))
    return placed.joined(behind)


def moves_of(robot: Robot, causes: Sequence[Cause]) -> tuple[dict[int, Move], Placed]:
    """Return the moves of joints (from 0) by number, and the causes behind the last joint as refused."""
    moves: dict[int, Move] = {}
    placed = Placed()
    for cause in causes:
        at = _at(robot, cause)
        if at >= robot.n_joints:
            placed.refuse([cause], "behind the last axis there is none that could lie elsewhere")
            continue
        move = moves.setdefault(at, Move())
        move.causes.append(cause)
        if cause.effect == LINK_GEOMETRY:
            move.shift_m = move.shift_m + _vector(cause)
        elif cause.effect == BASE_TILT:
            move.turned = _level(cause).inv()
        else:
            move.zero_rad += cause.parameters[JOINT_ZERO[1]].value
    return moves, placed


def _done(placed: Placed, causes: Sequence[Cause], why: str) -> None:
    if why:
        placed.refuse(causes, why)
    else:
        placed.take(causes)


def _at(robot: Robot, cause: Cause) -> int:
    """Return the joint (from 0) whose position a cause changes."""
    if cause.axis is None:
        return 0
    joint = int(robot.axis_joints[cause.axis - 1])
    return joint + 1 if cause.effect == LINK_GEOMETRY else joint


def _vector(cause: Cause) -> Array:
    return np.array([cause.parameters[name].value for name in ("x_m", "y_m", "z_m")])


def _level(cause: Cause) -> Rotation:
    """Return the rotation of gravity in the frame of a tilted base: R_y(-b) R_x(-a)."""
    angles = [-cause.parameters[name].value for name in ("about_x_rad", "about_y_rad")]
    return Rotation.from_euler("xy", angles)


def _below(tree: Tree, chain: Chain, at: int) -> Rotation:
    """Return the rotation from the base to the body that carries a joint, at zero angles."""
    carrier = chain.joints[at].body.parent
    turned = np.eye(3)
    for body in tree.path(carrier) if carrier is not None else ():
        turned = turned @ body.pose.rotation
    return Rotation.from_matrix(turned)


def _urdf(edits: Edits, root: Element, model: tuple[Tree, Chain], at: int, move: Move) -> str:
    """Set or add the <origin> of a joint; return why that failed, empty if it did not."""
    tree, chain = model
    body = chain.joints[at].body
    joint = next(e for e in root.all("joint") if e.attributes.get("name") == body.joint)
    pose = moved(tree, chain, at, move)
    turned = Rotation.from_matrix(pose.rotation)
    numbers = {"xyz": pose.origin.tolist(), "rpy": turned.as_euler("xyz").tolist()}
    if move.zero_rad == 0 and move.turned.magnitude() == 0:
        del numbers["rpy"]
    if np.allclose(pose.origin, body.pose.origin, rtol=0, atol=1e-12):
        del numbers["xyz"]
    origin = joint.find("origin")
    if origin is None:
        edits.add(joint, "origin", numbers, said(move.causes))
    else:
        edits.set(origin, numbers, said(move.causes))
    return ""


def moved(tree: Tree, chain: Chain, at: int, move: Move) -> Pose:
    """Return the pose of a moved joint (from 0) in the body that carries it."""
    body = chain.joints[at].body
    below = _below(tree, chain, at)
    tilt = below.inv() * move.turned * below
    place = tilt.apply(body.pose.origin) + below.inv().apply(move.shift_m)
    turned = tilt * Rotation.from_matrix(body.pose.rotation) * _about(body.axis, move.zero_rad)
    return Pose(turned.as_matrix(), place)


def _about(axis: Array, angle_rad: float) -> Rotation:
    return Rotation.from_rotvec(angle_rad * axis / np.linalg.norm(axis))


def _mjcf(edits: Edits, root: Element, model: tuple[Tree, Chain], at: int, move: Move) -> str:
    """Set the position of a body and the reference of its joint; return why that failed, else empty."""
    tree, chain = model
    joint = chain.joints[at].body
    named = {(e.tag, e.attributes.get("name")): e for e in root.walk()}
    body, own = named.get(("body", joint.of)), named.get(("joint", joint.joint))
    why = _why_not(root, body, own, move)
    if why:
        return why
    assert body is not None
    assert own is not None
    if np.any(move.shift_m):
        if chain.joints[at - 1].body.of == joint.of:
            return f"both axes are joints of one body, {joint.of!r}"
        shift = _below(tree, chain, at).inv().apply(move.shift_m)
        place = np.array(body.numbers("pos", 3, (0.0, 0.0, 0.0))) + shift
        edits.set(body, {"pos": place.tolist()}, said(_of(move, LINK_GEOMETRY)))
    if move.zero_rad:
        # An angle that exceeds its reading means a smaller reference.
        reference = own.number("ref", 0.0) - move.zero_rad * angle_unit(root)
        edits.set(own, {"ref": reference}, said(_of(move, JOINT_ZERO[0])))
    return ""


def _why_not(root: Element, body: Element | None, own: Element | None, move: Move) -> str:
    """Return why the text of a joint and its body cannot be changed in an MJCF; empty if it can."""
    if body is None or own is None:
        return "its body or joint stands in another file or has no name"
    if np.any(move.shift_m) and any(body in frame.walk() for frame in _all(root, "frame")):
        return f"{body.attributes['name']!r} stands in a <frame>"
    if not move.zero_rad:
        return ""
    defaults = [e for default in _all(root, "default") for e in _all(default, "joint")]
    if "ref" not in own.attributes and any("ref" in e.attributes for e in defaults):
        return "defaults say where the zero of joints is"
    if any(e.attributes.get("joint1") == own.attributes["name"] for e in root.walk()):
        return "a constraint counts from the zero of the joint"
    return ""


def _all(root: Element, tag: str) -> Iterator[Element]:
    return (e for e in root.walk() if e.tag == tag)


def _of(move: Move, effect: str) -> list[Cause]:
    return [cause for cause in move.causes if cause.effect == effect]


def angle_unit(root: Element) -> float:
    """Return one radian in the unit of angles that an MJCF chooses."""
    said_so = [e.attributes["angle"] for e in _all(root, "compiler") if "angle" in e.attributes]
    return 1.0 if said_so[-1:] == ["radian"] else math.degrees(1.0)


def _gravity(edits: Edits, root: Element, chain: Chain, cause: Cause) -> str:
    """Rotate the gravity of an MJCF; return why that failed, else empty."""
    if chain.gravity_share == 0:
        return "all weight is compensated"
    tilted = _level(cause).apply(chain.gravity_m_s2) / chain.gravity_share
    gravity = {"gravity": tilted.tolist()}
    options = root.all("option")
    own = [e for e in options if "gravity" in e.attributes]
    if not own and any(_all(root, "include")):
        return "gravity may stand in another file"
    if options:
        edits.set((own or options)[-1], gravity, said([cause]))
    else:
        edits.add(root, "option", gravity, said([cause]))
    return ""
