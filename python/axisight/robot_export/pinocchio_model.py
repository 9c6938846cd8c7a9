"""Export a robot as a ``pinocchio.Model``."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from axisight.errors import MissingExtraError
from axisight.robot import JointLimits, Link, Robot
from axisight.robot_export.dry_friction import joint_friction_nm


def to_pinocchio(robot: Robot) -> Any:
    """Return a ``pinocchio.Model`` of the robot with all joints, driven and elastic, under the same names.

    Its ``rnea`` equals `Robot.inverse_dynamics`. A floating base is a ``JointModelFreeFlyer`` with the name
    ``root_joint``. Rotors are in ``rotorInertia`` [kg m^2, motor side] and
    ``rotorGearRatio`` (motor angle per joint angle). Viscous friction is in ``damping``, Coulomb friction in
    the limits of dry friction, both joint-side. Position, velocity and effort have the limits of the robot,
    infinite where it states none. The model has no place for limits of acceleration, springs of gears and
    elastic joints, the controller and all other effects. Raises MissingExtraError if Pinocchio is not installed.
    """
    try:
        pinocchio = import_module("pinocchio")
    except ImportError as error:
        raise MissingExtraError("to_pinocchio needs Pinocchio: pip install 'pin>=3'") from error
    model = pinocchio.Model()
    model.name = robot.name
    model.gravity.linear = robot.gravity_m_s2
    friction = joint_friction_nm(robot)
    limits = dict(zip(robot.axis_names, robot.joint_limits, strict=True))
    base = 0  # Joint 0 of Pinocchio is the universe.
    if robot.floating_base is not None:
        flyer, still = pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity()
        base = model.addJoint(0, flyer, still, "root_joint")
        model.appendBodyToJoint(base, _inertia(pinocchio, robot.floating_base), still)
    for joint in robot.joints:
        kind = (
            pinocchio.JointModelPrismaticUnaligned
            if joint.prismatic
            else pinocchio.JointModelRevoluteUnaligned
        )
        placement = pinocchio.SE3(np.eye(3), joint.origin_m)
        before = base if joint.parent is None else base + joint.parent + 1
        parent = model.addJoint(before, kind(joint.axis), placement, joint.name)
        if joint.link is not None:
            body = _inertia(pinocchio, joint.link)
            model.appendBodyToJoint(parent, body, pinocchio.SE3.Identity())
        v = model.joints[parent].idx_v
        if joint.drive is not None:
            ratio = joint.drive.gear_ratio
            model.rotorInertia[v] = joint.drive.motor_inertia
            model.rotorGearRatio[v] = 1.0 / ratio
            model.damping[v] = joint.drive.viscous_friction / ratio**2
        allowed = limits.get(joint.name, JointLimits())
        low, high = allowed.position or (-np.inf, np.inf)
        # These joints have one configuration for each speed.
        q = model.joints[parent].idx_q
        model.lowerPositionLimit[q], model.upperPositionLimit[q] = low, high
        model.velocityLimit[v] = np.inf if allowed.velocity is None else allowed.velocity
        model.effortLimit[v] = np.inf if allowed.effort is None else allowed.effort
        dry = friction.get(joint.name, 0.0)
        model.lowerDryFrictionLimit[v], model.upperDryFrictionLimit[v] = -dry, dry
    return model


def _inertia(pinocchio: Any, link: Link) -> Any:
    xx, yy, zz, xy, xz, yz = link.inertia_kg_m2
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pinocchio.Inertia(link.mass_kg, link.com_m, inertia)
