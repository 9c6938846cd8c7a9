"""Make a serial chain from a tree of bodies: merge fixed joints, and refuse or lock other branches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from axisight.errors import RobotError
from axisight.robot_import.bodies import Body, Mass, Pose, Steps, Tree, joined, still

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ChainJoint:
    """A joint of the chain, in frames that are parallel to the base frame at zero angle.

    ``origin_m`` (3,) [m] and ``axis`` (3,) are in the parent's frame, ``mass`` is in the frame of the joint.
    ``body`` is the body in the file; ``rotation`` (3, 3) is the orientation of its frame in the joint's.
    """

    body: Body
    origin_m: Array
    axis: Array
    mass: Mass | None
    rotation: Array


@dataclass(frozen=True)
class Chain:
    """A serial chain from a model file, with notes on how it was made.

    ``end`` is the pose of the last link's frame in the file, in the frame of the last joint. ``steps`` are
    the time steps of the simulator of the file. ``gravity_m_s2`` (3,) is the share ``gravity_share`` of the
    file's. ``holds_weight``: actuators compensate the weight.
    """

    name: str
    joints: tuple[ChainJoint, ...]
    end: Pose
    gravity_m_s2: Array
    notes: tuple[str, ...]
    steps: Steps | None = None
    gravity_share: float = 1.0
    holds_weight: bool = False


STANDARD_GRAVITY_M_S2 = 9.81


def chain_of(tree: Tree, base: str | None = None, tip: str | None = None) -> Chain:
    """Return the serial chain between two bodies of a tree.

    ``base`` is the fixed body, by default the root. ``tip`` is the last body, by default the end of the only
    moving branch. Bodies on fixed joints are merged with their parents. With a ``tip``, other moving branches
    and everything beyond the tip are locked at zero; their masses stay.

    Raises RobotError for bodies that are not there, several branches without a ``tip``, joints that a chain
    cannot have, moving bodies without mass, and inertias that no body has.
    """
    root = next(iter(tree.bodies.values()))
    for option, name in (("base", base), ("tip", tip)):
        if name is not None and name not in tree.bodies:
            near = get_close_matches(name, tree.bodies, n=5) or tree.bodies
            raise RobotError(
                f"{root.where}: --{option}: expected a link, such as {_listed(near)}, got {name!r}"
            )
    first = root.name if base is None else base
    last = _only_end(tree, first) if tip is None else tip
    path = tree.path(last)
    names = [body.name for body in path]
    if first not in names:
        raise RobotError(
            f"{tree.bodies[first].where}: --base: expected a link between {names[0]!r} and the "
            f"tip {last!r}, got {first!r}"
        )
    path = path[names.index(first) :]
    joints, end, notes = _joints(tree, path)
    gravity = tree.gravity_m_s2
    if gravity is None:
        gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY_M_S2])
    return Chain(
        tree.name,
        tuple(joints),
        end,
        gravity * tree.gravity_share,
        (*tree.notes, *notes),
        tree.steps,
        tree.gravity_share,
        tree.holds_weight,
    )


def _listed(names: Sequence[str] | dict[str, Body]) -> str:
    shown = list(names)
    return ", ".join(shown[:30]) + (f" and {len(shown) - 30} more" if len(shown) > 30 else "")


def _only_end(tree: Tree, first: str) -> str:
    """Return the last moving body below ``first``; raise RobotError if there are several branches."""
    ends = _ends(tree, first)
    if len(ends) > 1:
        shown = [tree.bodies[end].of or end for end in ends]
        paths = [[body.name for body in tree.path(end)] for end in ends]
        trunk = [name for name in paths[0] if all(name in path for path in paths)]
        robots = _robots(tree, trunk[-1], paths)
        if len(robots) > 1:
            raise RobotError(
                f"{tree.bodies[first].where}: expected one robot, got {len(robots)} that stand apart: give the body "
                f"on which the one that is meant stands, --base (of diagnose, check, columns guess, explore, "
                f"simulate, excite and robot import) or base = '...' in the drive data beside the file, one of "
                f"{_listed(robots)}"
            )
        raise RobotError(
            f"{tree.bodies[trunk[-1]].where}: expected one serial chain below {first!r}, got {len(ends)} moving "
            f"branches: give the last link of the one that is meant, --tip (of diagnose, "
            f"check, columns guess, explore, simulate, excite and robot import) or "
            f"tip = '...' in the drive data beside the file (they end at "
            f"{_listed(shown)} and part at {trunk[-1]}); other branches are locked at zero"
        )
    return (tree.bodies[ends[0]].of or ends[0]) if ends else first


def _robots(tree: Tree, trunk: str, paths: Sequence[Sequence[str]]) -> list[str]:
    """Return the fixed bodies on the root on which several robots stand; empty if one of them has none.

    ``trunk``: body at which the ``paths`` to the ends part.
    """
    if tree.bodies[trunk].parent is not None:
        return []
    first = list(dict.fromkeys(path[path.index(trunk) + 1] for path in paths))
    fixed = [name for name in first if tree.bodies[name].motion == "fixed"]
    return fixed if len(fixed) == len(first) else []


def _ends(tree: Tree, first: str) -> list[str]:
    """Return the moving bodies below ``first`` that have no moving body below them."""
    out: list[str] = []
    for child in tree.children(first):
        below = _ends(tree, child.name)
        out += below or ([child.name] if child.motion != "fixed" else [])
    return out


def _joints(tree: Tree, path: Sequence[Body]) -> tuple[list[ChainJoint], Pose, list[str]]:
    """Return the moving joints along a path, the last body's pose in the last joint's frame, and notes."""
    chosen = {body.name for body in path}
    # Start from the orientation in the root frame, in which the file states gravity.
    here = Pose(_from_root(tree, path[0]).rotation, np.zeros(3))
    locked: list[str] = []
    carried: list[Body] = []
    # Masses that move with the previous joint; those fixed to the base do not matter.
    with_last: list[Mass] = []
    moving: list[tuple[Body, Pose, list[Mass]]] = []
    for body in path[1:]:
        here = here @ body.pose
        masses = _carried(tree, body, here, chosen, locked, carried)
        if body.motion == "fixed":
            with_last += masses
            continue
        if body.refused or body.motion == "other":
            raise RobotError(f"{body.where}: {body.refused}")
        with_last = masses
        moving.append((body, here, with_last))
    if not moving:
        raise RobotError(
            f"{path[-1].where}: expected at least one revolute, continuous or prismatic joint between "
            f"{path[0].name!r} and {path[-1].name!r}, got none"
        )
    joints: list[ChainJoint] = []
    before = np.zeros(3)
    for body, at, masses in moving:
        mass = joined(m.at(Pose(np.eye(3), -at.origin)) for m in masses)
        _check(body, mass)
        joints.append(
            ChainJoint(body, at.origin - before, at.rotation @ body.axis, mass, at.rotation)
        )
        before = at.origin
    notes = [f"locked at zero, masses carried along: {_listed(locked)}"] if locked else []
    notes += [said for body in carried if (said := _impossible(body))]
    return joints, Pose(here.rotation, here.origin - before), notes


def _from_root(tree: Tree, body: Body) -> Pose:
    pose = still()
    for one in tree.path(body.name):
        pose = pose @ one.pose
    return pose


def _carried(
    tree: Tree,
    body: Body,
    here: Pose,
    chosen: set[str],
    locked: list[str],
    carried: list[Body],
) -> list[Mass]:
    """Return the masses of a body and of all its branches outside the chain, in the base frame.

    The names of the joints that are thereby locked go to ``locked``, and all these bodies to ``carried``.
    """
    out = [] if body.mass is None else [body.mass.at(here)]
    carried.append(body)
    for child in tree.children(body.name):
        if child.name not in chosen:
            if child.motion != "fixed":
                locked.append(child.joint)
            out += _carried(tree, child, here @ child.pose, chosen, locked, carried)
    return out


# Moments with three digits are off by up to 0.5 % each, so those of a plate, where the largest is the sum of
# the others, may violate the triangle inequality by 1 % of the largest.
_ROUNDED = 0.01


def _impossible(body: Body) -> str | None:
    """Return a note if the principal moments of a body violate the triangle inequality; None if not."""
    if body.mass is None:
        return None
    low, middle, high = np.linalg.eigvalsh(body.mass.inertia_kg_m2).tolist()
    if high - low - middle <= _ROUNDED * high:
        return None
    return (
        f"inertia of {(body.of or body.name)!r}: principal moments {low:g}, {middle:g}, {high:g} kg m^2, of which "
        f"no body has one above the sum of the others: taken as it is, look at its numbers"
    )


def _check(body: Body, mass: Mass | None) -> None:
    """Raise RobotError for a moving body without mass or with an impossible inertia."""
    if mass is None and body.bare:
        return
    what = f"{(body.of or body.name)!r} and all that is fixed to it"
    if mass is None or mass.mass_kg <= 0:
        raise RobotError(
            f"{body.where}: expected a mass on what the joint moves ({what}), got none: without one nothing "
            f"says which torque it takes"
        )
    moments = np.linalg.eigvalsh(mass.inertia_kg_m2)
    if moments[0] <= 1e-12 * abs(moments[-1]):
        shown = ", ".join(f"{m:.3g}" for m in moments)
        raise RobotError(
            f"{body.where}: expected an inertia with three positive principal moments on {what}, got {shown} "
            f"kg m^2"
        )
