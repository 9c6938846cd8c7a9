"""Read the bodies of a USD stage; zero of every joint is where its two frames coincide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import RobotError
from axisight.robot import JointLimits
from axisight.robot_import.bodies import Body, Drive, Motion, Pose, Tree, still
from axisight.robot_import.chain import STANDARD_GRAVITY_M_S2
from axisight.robot_import.usd import notes
from axisight.robot_import.usd.attributes import Units
from axisight.robot_import.usd.drives import drive_of
from axisight.robot_import.usd.frames import Frames, body_above
from axisight.robot_import.usd.masses import mass_of
from axisight.robot_import.usd.stage import open_stage, pxr, units_of

Array = NDArray[np.float64]

WORLD = "world"
"""Name of the body that everything stands on."""
_MOTIONS: dict[str, Motion] = {
    "PhysicsRevoluteJoint": "revolute",
    "PhysicsPrismaticJoint": "prismatic",
    "PhysicsFixedJoint": "fixed",
}
_AXES = {"X": 0, "Y": 1, "Z": 2}


@dataclass(frozen=True, eq=False)
class Link:
    """A joint of a stage: its prim, and for both sides the body and the pose of the joint frame in it.

    ``bodies``: paths of the bodies, empty for the world. ``flipped``: the second body carries the first.
    """

    prim: Any
    bodies: tuple[str, str]
    frames: tuple[Pose, Pose]
    flipped: bool = False

    def turned(self) -> Link:
        """Return the joint with its bodies in the other order."""
        return Link(self.prim, self.bodies[::-1], self.frames[::-1], not self.flipped)


@dataclass
class UsdModel:
    """A stage with its tree: ``bodies`` and ``joints`` are the prims by name, ``units`` those of the stage."""

    stage: Any
    units: Units
    tree: Tree
    bodies: dict[str, Any] = field(default_factory=dict)
    joints: dict[str, Link] = field(default_factory=dict)


def read_usd(path: Path) -> Tree:
    """Return the bodies of a USD file, in the frame of its stage; errors as in `usd_model`."""
    return usd_model(path).tree


def usd_model(path: Path) -> UsdModel:
    """Return a USD file with its bodies and joints.

    Joints are revolute, prismatic and fixed. Notes list what a serial chain cannot have. Raises RobotError
    with file and prim, and MissingExtraError without usd-core.
    """
    stage = open_stage(path)
    return _Reader(stage, path).model()


class _Reader:
    """Collects bodies and joints of one stage."""

    def __init__(self, stage: Any, path: Path) -> None:
        self.stage, self.path, self.units = stage, path, units_of(stage)
        self.frames = Frames(self.units.length_m)
        physics, usd = pxr("UsdPhysics"), pxr("Usd")
        prims = list(usd.PrimRange.Stage(stage, usd.TraverseInstanceProxies()))
        self.bodies = {str(p.GetPath()): p for p in prims if body_above(p) == p}
        self.joint_prims = [p for p in prims if p.IsA(physics.Joint)]
        self.scenes = [p for p in prims if p.IsA(physics.Scene)]
        self.names = _names([*self.bodies, *(str(p.GetPath()) for p in self.joint_prims)])
        self.notes: list[str] = []
        # Bodies that stand still on the world: their masses move nothing.
        self.standing = {WORLD}

    def model(self) -> UsdModel:
        """Return the model, bodies parents first."""
        if not self.joint_prims:
            raise RobotError(f"{self.path}: expected joints (PhysicsRevoluteJoint), got none")
        links = self._links()
        root = Body(WORLD, None, "", "fixed", still(), np.zeros(3), None, str(self.path))
        tree = Tree(self._name(), {WORLD: root}, str(self.path), self._gravity(), self.notes)
        model = UsdModel(self.stage, self.units, tree)
        for path in self._roots(links):
            self._add_root(model, path)
            self._grow(model, links, path)
        self._grow(model, links, "")
        lost = [link for link in links if self._of(link.prim) not in model.joints]
        if lost:
            raise RobotError(
                f"{self._where(lost[0].prim)}: expected a tree, got a closed loop: exclude the joint that closes "
                f"it from the articulation (physics:excludeFromArticulation)"
            )
        free = [self.names[p] for p in self.bodies if self.names[p] not in model.bodies]
        if free:
            self.notes.append(f"bodies without a joint left out: {', '.join(free)}")
        return model

    def _name(self) -> str:
        prim = self.stage.GetDefaultPrim()
        return str(prim.GetName()) if prim else self.path.stem

    def _where(self, prim: Any) -> str:
        return f"{self.path}, <{prim.GetPath()}>"

    def _of(self, prim: Any) -> str:
        return self.names[str(prim.GetPath())]

    def _links(self) -> list[Link]:
        """Return the joints of the articulation; others are listed in the notes."""
        physics, out = pxr("UsdPhysics"), []
        for prim in self.joint_prims:
            joint = physics.Joint(prim)
            excluded = joint.GetExcludeFromArticulationAttr().Get()
            if excluded or joint.GetJointEnabledAttr().Get() is False:
                why = "excluded from the articulation" if excluded else "not enabled"
                self.notes.append(f"joint {self._of(prim)!r} left out: {why}")
                continue
            link = self._link(prim, joint)
            if link.bodies[0] == link.bodies[1]:
                self.notes.append(f"joint {self._of(prim)!r} left out: it connects no two bodies")
                continue
            out.append(link)
        return out

    def _link(self, prim: Any, joint: Any) -> Link:
        ends, frames = [], []
        sides = (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        )
        for rel, place, turned in sides:
            targets = rel.GetTargets()
            holder = self.stage.GetPrimAtPath(targets[0]) if targets else None
            if targets and not holder:
                raise RobotError(
                    f"{self._where(prim)}: {rel.GetName()}: expected a prim, got {targets[0]}"
                )
            body = None if holder is None else body_above(holder)
            ends.append("" if body is None else str(body.GetPath()))
            frames.append(self.frames.of_joint(holder, body, place.Get(), turned.Get()))
        return Link(prim, (ends[0], ends[1]), (frames[0], frames[1]))

    def _roots(self, links: Sequence[Link]) -> list[str]:
        """Return the bodies that stand on the world without a joint: first bodies of floating trees."""
        parts = _parts(links)
        out = []
        for part in (part for part in parts if "" not in part):
            carried = {link.bodies[1] for link in links if link.bodies[1] in part}
            first = [p for p in self.bodies if p in part and p not in carried]
            out.append((first or [p for p in self.bodies if p in part])[0])
        return out

    def _add_root(self, model: UsdModel, path: str) -> None:
        prim = self.bodies[path]
        self.notes.append(
            f"body {self.names[path]!r} is fixed to no body: taken as fixed where the stage puts it"
        )
        self._add(model, path, WORLD, self.frames.world(prim))

    def _add(self, model: UsdModel, path: str, parent: str, pose: Pose) -> None:
        """Add a body that stands still in ``parent``."""
        prim, name = self.bodies[path], self.names[path]
        where, mass = self._where(prim), None
        if parent in self.standing:
            self.standing.add(name)
        else:
            mass = mass_of(prim, where, self.units, self.frames.scale(prim))
        model.tree.bodies[name] = Body(name, parent, "", "fixed", pose, np.zeros(3), mass, where)
        model.bodies[name] = prim

    def _grow(self, model: UsdModel, links: Sequence[Link], path: str) -> None:
        """Add everything that joints connect to the body at ``path``, from there outwards."""
        todo = [path]
        while todo:
            here = todo.pop()
            for found in links:
                if here not in found.bodies or self._of(found.prim) in model.joints:
                    continue
                link = found if found.bodies[0] == here else found.turned()
                child = link.bodies[1]
                if child == "" or self.names[child] in model.bodies:
                    continue
                self._join(model, link, self.names[here] if here else WORLD)
                todo.append(child)

    def _join(self, model: UsdModel, link: Link, parent: str) -> None:
        """Add a joint as a massless body at its frame, and the body that it moves."""
        prim, child = link.prim, link.bodies[1]
        name, motion = self._of(prim), _MOTIONS.get(str(prim.GetTypeName()), "other")
        model.joints[name] = link
        if motion == "fixed":
            pose = link.frames[0] @ link.frames[1].inverse()
            self._add(model, child, parent, pose)
            return
        turns = motion == "revolute"
        moving = motion != "other"
        if moving:
            self.notes += notes.of_joint(prim, name, self.units, turns=turns)
        # The arrow makes the name unique, as names in USD cannot contain it.
        frame = Body(
            f"{self.names[child]}\N{RIGHTWARDS ARROW}{name}",
            parent,
            name,
            motion,
            link.frames[0],
            self._axis(link) if moving else np.zeros(3),
            None,
            self._where(prim),
            drive_of(prim, self._where(prim), self.units, turns=turns) if moving else Drive(),
            self._limits(link, turns=turns) if moving else JointLimits(),
            ""
            if moving
            else f"expected a revolute, prismatic or fixed joint, got {prim.GetTypeName()}",
            of=self.names[child],
        )
        model.tree.bodies[frame.name] = frame
        self._add(model, child, frame.name, link.frames[1].inverse())

    def _axis(self, link: Link) -> Array:
        """Return the direction (3,) of a joint in its frame; it turns around if the bodies are flipped."""
        token = link.prim.GetAttribute("physics:axis").Get() or "X"
        out = np.zeros(3)
        out[_AXES[str(token)]] = -1.0 if link.flipped else 1.0
        return out

    def _limits(self, link: Link, *, turns: bool) -> JointLimits:
        """Return the range of a joint [rad or m], if it has one."""
        values = [link.prim.GetAttribute(f"physics:{end}Limit").Get() for end in ("lower", "upper")]
        low, high = (float("nan") if value is None else float(value) for value in values)
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            return JointLimits()
        unit = np.pi / 180 if turns else self.units.length_m
        return JointLimits((low * unit, high * unit))

    def _gravity(self) -> Array:
        """Return the gravity (3,) of the first scene [m/s^2]; USD's defaults are 9.81 m/s^2 downwards."""
        down = np.zeros(3)
        down[_AXES[self.units.up]] = -1.0
        if not self.scenes:
            return down * STANDARD_GRAVITY_M_S2
        scene = pxr("UsdPhysics").Scene(self.scenes[0])
        if len(self.scenes) > 1:
            self.notes.append(f"gravity of {self.scenes[0].GetPath()}, the first scene of several")
        stated = np.array(scene.GetGravityDirectionAttr().Get(), dtype=np.float64)
        along = stated / np.linalg.norm(stated) if np.any(stated) else down
        size = float(scene.GetGravityMagnitudeAttr().Get())
        if not np.isfinite(size) or size < 0:
            return np.asarray(along * STANDARD_GRAVITY_M_S2)
        return np.asarray(along * size * self.units.length_m)


def _parts(links: Sequence[Link]) -> list[set[str]]:
    """Return the sets of bodies that joints connect; the world is the empty path."""
    parts: list[set[str]] = []
    for link in links:
        touched = [part for part in parts if part & set(link.bodies)]
        rest = [part for part in parts if part not in touched]
        parts = [*rest, set(link.bodies).union(*touched)]
    return parts


def _names(paths: Sequence[str]) -> dict[str, str]:
    """Return a unique name for each path: the last part, or the path if several prims share that."""
    last = [path.rpartition("/")[2] for path in paths]
    return {
        path: name if last.count(name) == 1 and name != WORLD else path
        for path, name in zip(paths, last, strict=True)
    }
