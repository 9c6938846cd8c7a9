"""Cut a chain or a smaller tree out of a tree of bodies: merge fixed joints, lock other branches."""

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
    """A joint, in frames that are parallel to the base frame at zero angle.

    ``origin_m`` (3,) [m] and ``axis`` (3,) are in the parent's frame, ``mass`` is in the frame of the joint.
    ``body`` is the body in the file; ``rotation`` (3, 3) is the orientation of its frame in the joint's.
    ``parent`` is the index of the joint that carries it, None on the base.
    """

    body: Body
    origin_m: Array
    axis: Array
    mass: Mass | None
    rotation: Array
    parent: int | None


@dataclass(frozen=True)
class Chain:
    """A chain, or a tree, of joints from a model file, with notes on how it was made.

    ``end`` is the pose of the last link's frame in the file, in the frame of the last joint. ``steps`` are
    the time steps of the simulator of the file. ``gravity_m_s2`` (3,) is the share ``gravity_share`` of the
    file's. ``holds_weight``: actuators compensate the weight. ``base``: mass of a floating base, in its frame;
    None for a fixed base.
    """

    name: str
    joints: tuple[ChainJoint, ...]
    end: Pose
    gravity_m_s2: Array
    notes: tuple[str, ...]
    steps: Steps | None = None
    gravity_share: float = 1.0
    holds_weight: bool = False
    base: Mass | None = None

    @property
    def is_chain(self) -> bool:
        """Whether no joint but the last one is without a next joint."""
        return all(joint.parent == (i - 1 if i else None) for i, joint in enumerate(self.joints))


STANDARD_GRAVITY_M_S2 = 9.81


def chain_of(
    tree: Tree,
    base: str | None = None,
    tip: str | Sequence[str] | None = None,
    *,
    whole_tree: bool = False,
    floating: bool = False,
) -> Chain:
    """Return the joints of a tree of bodies from one body on: a serial chain, or several branches.

    ``base`` is the fixed body, by default the root. ``tip`` is the last body, or the last bodies of several
    branches. By default it is the end of the only moving branch; with ``whole_tree``, the ends of all. Bodies
    on fixed joints are merged with their parents. With a ``tip``, other moving branches and everything beyond
    a tip are locked at zero; their masses stay. With ``whole_tree``, joints that follow another joint
    are locked at zero. With ``floating``, the base floats. It is then by default the body on the only free joint
    of the file, else the root, and the frame of the base is that of this body.

    Raises RobotError for bodies that are not there, several branches without a ``tip``, a ``tip`` beside
    ``whole_tree``, joints that a robot cannot have, moving bodies without mass, inertias that no body has, and
    several free joints without a ``base``.
    """
    root = next(iter(tree.bodies.values()))
    tips = [tip] if isinstance(tip, str) else list(tip or ())
    if tips and whole_tree:
        raise RobotError(
            f"{root.where}: whole_tree: expected no tip beside it, got {_listed(tips)}"
        )
    for option, name in (("base", base), *(("tip", name) for name in tips)):
        if name is not None and name not in tree.bodies:
            near = get_close_matches(name, tree.bodies, n=5) or tree.bodies
            raise RobotError(
                f"{root.where}: --{option}: expected a link, such as {_listed(near)}, got {name!r}"
            )
    first = base or (_free_body(tree) if floating else None) or root.name
    if whole_tree:
        tips = _ends(tree, first) or [first]
    elif not tips:
        tips = [_only_end(tree, first)]
    chosen: dict[str, None] = {}
    for name in tips:
        path = [body.name for body in tree.path(name)]
        if first not in path:
            raise RobotError(
                f"{tree.bodies[first].where}: --base: expected a link between {path[0]!r} and the "
                f"tip {name!r}, got {first!r}"
            )
        chosen |= dict.fromkeys(path[path.index(first) :])
    cut = _Cut(tree, first, frozenset(chosen), locks_followers=whole_tree, floating=floating)
    joints = cut.joints(tips)
    carried = cut.base() if floating else None
    gravity = tree.gravity_m_s2
    if gravity is None:
        gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY_M_S2])
    notes = (*tree.notes, *cut.notes())
    return Chain(
        tree.name,
        tuple(joints),
        cut.end(tips[-1]),
        gravity * tree.gravity_share,
        notes,
        tree.steps,
        tree.gravity_share,
        tree.holds_weight,
        carried,
    )


def _free_body(tree: Tree) -> str | None:
    """Return the body on the only free joint, None without one; raise RobotError for several."""
    free = [body for body in tree.bodies.values() if body.is_free]
    if len(free) > 1:
        raise RobotError(
            f"{free[1].where}: floating: expected one free joint, got {len(free)}: give the body that floats, "
            f"--base, one of {_listed([body.of or body.name for body in free])}"
        )
    return (free[0].of or free[0].name) if free else None


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
            f"{_listed(shown)} and part at {trunk[-1]}); other branches are locked at zero. "
            f"whole_tree = true there, or robot import --whole-tree, takes all"
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


class _Cut:
    """The part of a tree between the body ``first`` and some tips: the bodies ``chosen``.

    With ``locks_followers``, joints that follow other joints are locked at zero, not refused. A base that is
    ``floating`` has the frame of its body; others have the axes of the root.
    """

    def __init__(
        self,
        tree: Tree,
        first: str,
        chosen: frozenset[str],
        *,
        locks_followers: bool,
        floating: bool,
    ) -> None:
        self.tree, self.first, self.chosen = tree, first, chosen
        self.locks_followers = locks_followers
        self.locked: list[str] = []
        self.following: list[str] = []
        self.carried: list[Body] = []
        # Start from the orientation in the root frame, in which the file states gravity.
        axes = np.eye(3) if floating else _from_root(tree, tree.bodies[first]).rotation
        self.poses = {first: Pose(axes, np.zeros(3))}
        self.on_base: list[Mass] = []
        # The index of the joint that moves a body, None on the base.
        self.moved_by: dict[str, int | None] = {first: None}

    def joints(self, tips: Sequence[str]) -> list[ChainJoint]:
        """Return the moving joints, parents before children; raise RobotError as `chain_of`."""
        moving: list[tuple[Body, int | None, list[Mass]]] = []
        for body in self._below_first():
            assert body.parent is not None  # only the root has none
            here = self.poses[body.parent] @ body.pose
            parent = self.moved_by[body.parent]
            masses = self._carried(body, here)
            self.poses[body.name], self.moved_by[body.name] = here, parent
            if self._is_fixed(body):
                (self.on_base if parent is None else moving[parent][2]).extend(masses)
                continue
            if body.refused or body.motion == "other":
                raise RobotError(f"{body.where}: {body.refused}")
            self.moved_by[body.name] = len(moving)
            moving.append((body, parent, masses))
        if not moving:
            tip = tips[-1]
            raise RobotError(
                f"{self.tree.bodies[tip].where}: expected at least one revolute, continuous or prismatic joint "
                f"between {self.first!r} and {tip!r}, got none"
            )
        out: list[ChainJoint] = []
        for body, parent, masses in moving:
            at = self.poses[body.name]
            before = np.zeros(3) if parent is None else self.poses[moving[parent][0].name].origin
            mass = joined(m.at(Pose(np.eye(3), -at.origin)) for m in masses)
            _check(body, mass)
            axis = at.rotation @ body.axis
            out.append(ChainJoint(body, at.origin - before, axis, mass, at.rotation, parent))
        self._moving = [body for body, _, _ in moving]
        return out

    def base(self) -> Mass:
        """Return the mass of the base and of all that is fixed to it; raise RobotError if it has none."""
        body = self.tree.bodies[self.first]
        mass = joined([*self._carried(body, self.poses[self.first]), *self.on_base])
        if mass is None:
            raise RobotError(
                f"{body.where}: expected a mass on the floating base {self.first!r}, got none: give the body that "
                f"floats, --base"
            )
        _check(body, mass, "the base")
        return mass

    def end(self, tip: str) -> Pose:
        """Return the pose of a tip in the frame of the last joint that moves it."""
        here, mover = self.poses[tip], self.moved_by[tip]
        before = np.zeros(3) if mover is None else self.poses[self._moving[mover].name].origin
        return Pose(here.rotation, here.origin - before)

    def notes(self) -> list[str]:
        """Return notes on locked joints and on impossible inertias."""
        out = []
        if self.locked:
            out.append(f"locked at zero, masses carried along: {_listed(self.locked)}")
        if self.following:
            out.append(
                f"locked at zero, as they follow other joints: {_listed(self.following)}; "
                f"couplings of joints are left out"
            )
        return out + [said for body in self.carried if (said := _impossible(body))]

    def _below_first(self) -> list[Body]:
        """Return the chosen bodies without the first one, every branch from base to tip."""
        out: list[Body] = []
        todo = [self.first]
        while todo:
            name = todo.pop()
            if name != self.first:
                out.append(self.tree.bodies[name])
            below = [b.name for b in self.tree.children(name) if b.name in self.chosen]
            todo += reversed(below)
        return out

    def _is_fixed(self, body: Body) -> bool:
        if body.follows and self.locks_followers:
            self.following.append(body.joint)
            return True
        return body.motion == "fixed"

    def _carried(self, body: Body, here: Pose) -> list[Mass]:
        """Return the masses of a body and of its branches that are not chosen, in the base frame."""
        out = [] if body.mass is None else [body.mass.at(here)]
        self.carried.append(body)
        for child in self.tree.children(body.name):
            if child.name not in self.chosen:
                if child.motion != "fixed":
                    self.locked.append(child.joint)
                out += self._carried(child, here @ child.pose)
        return out


def _from_root(tree: Tree, body: Body) -> Pose:
    pose = still()
    for one in tree.path(body.name):
        pose = pose @ one.pose
    return pose


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


def _check(body: Body, mass: Mass | None, moves: str = "the joint") -> None:
    """Raise RobotError for a moving body without mass or with an impossible inertia; ``moves`` moves it."""
    if mass is None and body.bare:
        return
    what = f"{(body.of or body.name)!r} and all that is fixed to it"
    if mass is None or mass.mass_kg <= 0:
        raise RobotError(
            f"{body.where}: expected a mass on what {moves} moves ({what}), got none: without one nothing "
            f"says which torque it takes"
        )
    moments = np.linalg.eigvalsh(mass.inertia_kg_m2)
    if moments[0] <= 1e-12 * abs(moments[-1]):
        shown = ", ".join(f"{m:.3g}" for m in moments)
        raise RobotError(
            f"{body.where}: expected an inertia with three positive principal moments on {what}, got {shown} "
            f"kg m^2"
        )
