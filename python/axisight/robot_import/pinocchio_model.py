"""Read the bodies of a ``pinocchio.Model``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import RobotError
from axisight.robot import JointLimits
from axisight.robot_import.bodies import Body, Drive, Mass, Motion, Pose, Tree, still

Array = NDArray[np.float64]


def tree_of(model: Any) -> Tree:
    """Return the bodies of a ``pinocchio.Model``; joint angles are those of its configuration vector.

    Drives have its rotors (``rotorInertia``, motor-side; ``rotorGearRatio``, motor angle per joint angle),
    damping and dry friction. Raises RobotError for a joint placement that mirrors.
    """
    name = model.names[0]
    bodies = {name: Body(name, None, "", "fixed", still(), np.zeros(3), None, model.name)}
    for i in range(1, model.njoints):
        bodies[model.names[i]] = _body(model, i)
    return Tree(model.name or "pinocchio", bodies, model.name, np.array(model.gravity.linear))


def _body(model: Any, i: int) -> Body:
    joint, placement = model.joints[i], model.jointPlacements[i]
    motion, axis = _motion(joint)
    if np.linalg.det(placement.rotation) < 0:
        raise RobotError(
            f"{model.name}, joint {model.names[i]!r}: expected a placement that turns, got one that mirrors: no "
            f"body can be put there"
        )
    return Body(
        model.names[i],
        model.names[model.parents[i]],
        model.names[i],
        motion,
        Pose(np.array(placement.rotation), np.array(placement.translation)),
        axis,
        _mass(model.inertias[i]),
        f"{model.name}, joint {model.names[i]!r}",
        _drive(model, joint.idx_v) if motion != "other" else Drive(),
        _limits(model, joint) if motion != "other" else JointLimits(),
        ""
        if motion != "other"
        else f"expected joints of one degree of freedom between base and tip, got {joint.shortname()}: "
        f"choose them beyond it by base and tip",
        is_free=joint.shortname() == "JointModelFreeFlyer",
    )


def _motion(joint: Any) -> tuple[Motion, Array]:
    """Return motion and axis of a joint from its motion subspace (linear, then angular velocity)."""
    if joint.nv != 1 or joint.nq > 2:
        return "other", np.zeros(3)
    data = joint.createData()
    # The configuration of a continuous joint is (cosine, sine).
    joint.calc(data, np.array([1.0, 0.0]) if joint.nq == 2 else np.zeros(1))
    along, about = np.split(np.asarray(data.S, dtype=np.float64).reshape(6), 2)
    turns, slides = bool(np.any(about)), bool(np.any(along))
    if turns == slides:
        return "other", np.zeros(3)
    return ("revolute", about) if turns else ("prismatic", along)


def _mass(inertia: Any) -> Mass | None:
    if inertia.mass <= 0:
        return None
    return Mass(float(inertia.mass), np.array(inertia.lever), np.array(inertia.inertia))


def _drive(model: Any, v: int) -> Drive:
    gear = float(model.rotorGearRatio[v]) or 1.0
    rotor = float(model.rotorInertia[v]) * gear**2 + float(model.armature[v])
    dry = float(model.upperDryFrictionLimit[v])
    return Drive(1.0 / gear, rotor, float(model.damping[v]), dry)


def _limits(model: Any, joint: Any) -> JointLimits:
    lower, upper = (
        float(x[joint.idx_q]) for x in (model.lowerPositionLimit, model.upperPositionLimit)
    )
    bounded = joint.nq == 1 and np.isfinite([lower, upper]).all() and lower < upper
    speed, effort = (float(x[joint.idx_v]) for x in (model.velocityLimit, model.effortLimit))
    return JointLimits(
        (lower, upper) if bounded else None,
        velocity=speed if 0 < speed < np.inf else None,
        effort=effort if 0 < effort < np.inf else None,
    )
