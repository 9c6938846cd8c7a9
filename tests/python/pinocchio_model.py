"""The robots of this project as Pinocchio models, built from the TOML text alone.

This module follows the file format's specification and uses nothing of the package, so that agreement with
the core means something.
"""

import tomllib
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]


def build(text: str) -> pin.Model:
    """Return the chain or tree of all joints; all frames are parallel at zero angle.

    A floating base is a free flyer: its rates and forces come first, linear ones before angular ones.
    """
    data: dict[str, Any] = tomllib.loads(text)
    model = pin.Model()
    model.gravity = pin.Motion(np.array(data["gravity"]), np.zeros(3))
    parent = base_joint = 0
    if data.get("base", {}).get("kind") == "floating":
        still = pin.SE3.Identity()
        parent = base_joint = model.addJoint(0, pin.JointModelFreeFlyer(), still, "root_joint")
        model.appendBodyToJoint(base_joint, _inertia(data["base"]["link"]), still)
    for joint in data["joint"]:
        if "parent" in joint:
            base = joint["parent"] == "base"
            parent = base_joint if base else model.getJointId(joint["parent"])
        axis = np.array(joint["axis"])
        kind = (
            pin.JointModelPrismaticUnaligned
            if joint.get("motion") == "prismatic"
            else pin.JointModelRevoluteUnaligned
        )
        placement = pin.SE3(np.eye(3), np.array(joint["origin"]))
        parent = model.addJoint(parent, kind(axis), placement, joint["name"])
        if "link" in joint:
            model.appendBodyToJoint(parent, _inertia(joint["link"]), pin.SE3.Identity())
    return model


def _inertia(link: dict[str, Any]) -> pin.Inertia:
    xx, yy, zz, xy, xz, yz = link["inertia"]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pin.Inertia(link["mass"], np.array(link["com"]), inertia)


def inertia_matrix(model: pin.Model, data: pin.Data, q: Array) -> Array:
    """Return the full symmetric inertia matrix; older versions fill the upper triangle only."""
    upper = np.triu(np.array(pin.crba(model, data, q)))
    return upper + np.triu(upper, 1).T


def point_jacobian(model: pin.Model, data: pin.Data, q: Array, joint: int, point: Array) -> Array:
    """Return linear, then angular velocity of a point of link ``joint`` (from 0), base axes."""
    frame = pin.Frame("point", joint + 1, pin.SE3(np.eye(3), point), pin.FrameType.OP_FRAME)
    extended = model.copy()
    number = extended.addFrame(frame)
    return np.array(
        pin.computeFrameJacobian(
            extended, extended.createData(), q, number, pin.LOCAL_WORLD_ALIGNED
        )
    )
