"""The exact change that causes make to bodies of a model file: mass, centre of mass, inertia.

A link of the chain is one or several bodies of the file, in a frame parallel to the base frame at zero
angles. Mass, first moment and inertia about one point add up. The body that the joint moves takes the whole
change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from axisight.effects.stated import LINK_COM, LINK_INERTIA, LINK_MASS, LOAD
from axisight.robot import Robot
from axisight.robot_import.bodies import Mass, Pose, Tree
from axisight.robot_import.chain import Chain, ChainJoint
from axisight.write_back.placed import Placed

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

Array = NDArray[np.float64]

LINK_EFFECTS = (LINK_MASS, LINK_COM, LINK_INERTIA, LOAD)


@dataclass(frozen=True, eq=False)
class BodyChange:
    """A body of the file by name, with its mass before and after in its own frame, and the causes."""

    body: str
    before: Mass
    after: Mass
    causes: tuple[Cause, ...]


def body_changes(
    tree: Tree, chain: Chain, robot: Robot, causes: Sequence[Cause]
) -> tuple[list[BodyChange], Placed]:
    """Return the changed bodies by causes on links and loads, and why the other causes cannot be written.

    ``tree`` and ``chain``: of the model file.
    """
    placed = Placed()
    by_joint: dict[int, list[Cause]] = {}
    for cause in causes:
        at = robot.n_joints - 1 if cause.axis is None else robot.axis_joints[cause.axis - 1]
        by_joint.setdefault(at, []).append(cause)
    out = []
    for at, mine in by_joint.items():
        joint = chain.joints[at]
        body = tree.bodies[joint.body.of or joint.body.name]
        if robot.joints[at].link is None or body.mass is None:
            placed.refuse(mine, f"{body.name!r} has no mass of its own")
            continue
        frame = _frame(joint, body.pose)
        after = _changed(robot, at, mine, body.mass.at(frame))
        after = None if after is None else after.at(frame.inverse())
        if after is None or not _possible(after):
            placed.refuse(mine, f"the inertia that {body.name!r} would have is that of no body")
            continue
        out.append(BodyChange(body.name, body.mass, after, tuple(mine)))
        placed.take(mine)
    return out, placed


def _frame(joint: ChainJoint, pose: Pose) -> Pose:
    """Return the pose of a body in its link's frame; ``pose``: of the body behind its joint."""
    turned = Pose(joint.rotation, np.zeros(3))
    # In URDF, joint and body are one element, and the pose is that of the joint in its parent.
    return turned @ pose if joint.body.of else turned


def _changed(robot: Robot, at: int, causes: Sequence[Cause], own: Mass) -> Mass | None:
    """Return the body with all causes on its link, in the frame of the link; None without a mass."""
    link = robot.joints[at].link
    assert link is not None
    xx, yy, zz, xy, xz, yz = link.inertia_kg_m2
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    before = Mass(link.mass_kg, np.asarray(link.com_m), inertia)
    after = before
    # In the simulator's order.
    for cause in causes:
        values = {name: p.value for name, p in cause.parameters.items()}
        after = _with(after, cause.effect, values)
    return _body(_sums(own) + _sums(after) - _sums(before))


def _with(mass: Mass, effect: str, values: Mapping[str, float]) -> Mass:
    place = np.array([values.get(name, 0.0) for name in ("x_m", "y_m", "z_m")])
    if effect == LINK_COM:
        return replace(mass, com_m=mass.com_m + place)
    if effect == LOAD:
        mass_kg = values["mass_kg"]
        load = Mass(mass_kg, place, mass_kg * values.get("gyration_m2", 0.0) * np.eye(3))
        found = _body(_sums(mass) + _sums(load))
        return mass if found is None else found
    factor = 1 + values["relative_change"]
    if effect == LINK_MASS:
        return replace(mass, mass_kg=mass.mass_kg * factor)
    return replace(mass, inertia_kg_m2=mass.inertia_kg_m2 * factor)


def _sums(mass: Mass) -> Array:
    """Return what adds up when bodies join: mass, first moment, inertia about the origin (13,)."""
    return np.concatenate(
        [[mass.mass_kg], mass.mass_kg * mass.com_m, (mass.inertia_kg_m2 + _steiner(mass)).ravel()]
    )


def _body(sums: Array) -> Mass | None:
    """Return the body with these sums; None without a mass."""
    if sums[0] <= 0:
        return None
    mass = Mass(float(sums[0]), sums[1:4] / sums[0], np.zeros((3, 3)))
    return replace(mass, inertia_kg_m2=sums[4:].reshape(3, 3) - _steiner(mass))


def _steiner(mass: Mass) -> Array:
    c = mass.com_m
    return np.asarray(mass.mass_kg * (c @ c * np.eye(3) - np.outer(c, c)))


def _possible(mass: Mass) -> bool:
    """Return whether the inertia is possible: no principal moment exceeds the sum of the others."""
    moments = np.linalg.eigvalsh(mass.inertia_kg_m2)
    return bool(moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9))
