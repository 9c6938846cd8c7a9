"""Export a robot as a MuJoCo model: elastic gears as two joints in series, rotors as armature."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError, MissingExtraError
from axisight.robot import JointLimits, Robot
from axisight.robot.description import Joint, Link
from axisight.robot_export.dry_friction import joint_friction_nm

Array = NDArray[np.float64]

MOTOR = "motor of "
"""Prefix, before the name of the driven joint, for the joint of a motor on an elastic gear."""


def to_mujoco(robot: Robot) -> Any:
    """Return the ``mujoco.MjModel`` of `mjcf`; raise MissingExtraError if MuJoCo is not installed."""
    try:
        mujoco = import_module("mujoco")
    except ImportError as error:
        raise MissingExtraError("to_mujoco needs MuJoCo: pip install 'axisight[mujoco]'") from error
    return mujoco.MjModel.from_xml_string(mjcf(robot))


def mjcf(robot: Robot) -> str:
    """Return a robot as MJCF text, with the same joint angles.

    - A driven joint with a rigid gear becomes a hinge (or slide). It has the rotor as ``armature``,
      J_m / r^2, viscous friction as ``damping``, F_v / r^2, and Coulomb friction as ``frictionloss``.
    - A driven joint with an elastic gear becomes two joints in series. ``motor of NAME`` has the motor angle
      times r and the drive. NAME has the stiffness and damping of the gear, and its angle is the joint angle
      minus the motor angle times r.
    - The inputs of the actuators are motor torques [Nm].
    - Limits of position become the ``range`` of the joint that the motor drives, limits of effort its
      ``actuatorfrcrange``. MuJoCo stops at both. An importer reads the second as a limit of the torque, too.
    - A massless link shares a body with the next link.
    - A floating base is a body ``base`` with a free joint.

    MJCF has no place for the controller and all other effects, such as ripples and backlash. It has none for
    limits of velocity and acceleration either: a comment says so if the robot states some. Raises InputError
    for a massless link with several joints on it, as a body of MuJoCo needs a mass.
    """
    root = ET.Element("mujoco", model=robot.name)
    lost = [
        x for x in ("velocity", "acceleration") if any(x in y.stated() for y in robot.joint_limits)
    ]
    if lost:
        root.append(ET.Comment(f" No place in MJCF for the limits of {' and '.join(lost)}. "))
    ET.SubElement(root, "compiler", angle="radian", autolimits="false")
    ET.SubElement(
        root, "option", gravity=_text(robot.gravity_m_s2), timestep=repr(robot.sample_time_s)
    )
    _bodies(ET.SubElement(root, "worldbody"), robot)
    actuators = ET.SubElement(root, "actuator")
    for name, ratio, rigid in zip(
        robot.axis_names, robot.gear_ratio.tolist(), robot.axis_is_rigid, strict=True
    ):
        driven = name if rigid else MOTOR + name
        ET.SubElement(actuators, "motor", name=name, joint=driven, gear=repr(1.0 / ratio))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _bodies(world: ET.Element, robot: Robot) -> None:
    """Append the bodies of a robot, each within the body that carries it; errors are those of `mjcf`."""
    friction = joint_friction_nm(robot)
    limits = dict(zip(robot.axis_names, robot.joint_limits, strict=True))
    bodies: dict[int | None, ET.Element] = {None: _base(world, robot)}
    # Of joints with a massless link: the body that carries them, and the joints since that body.
    waiting: dict[int | None, tuple[ET.Element, list[Joint]]] = {}
    for i, joint in enumerate(robot.joints):
        if joint.parent in bodies:
            carrier, joints = bodies[joint.parent], [joint]
        elif joint.parent in waiting:
            carrier, before = waiting.pop(joint.parent)
            joints = [*before, joint]
        else:
            assert joint.parent is not None  # the base is a body
            raise InputError(
                f"{robot.joint_names[joint.parent]}: expected a link with mass, as several joints are on it, got "
                f"a massless one: a body of MuJoCo needs a mass"
            )
        if joint.link is None:
            waiting[i] = carrier, joints
        else:
            bodies[i] = _body(carrier, joints, friction, limits)


def _base(world: ET.Element, robot: Robot) -> ET.Element:
    """Return the body that carries the first joints: the world, or a body with a free joint."""
    link = robot.floating_base
    if link is None:
        return world
    body = ET.SubElement(world, "body", name="base")
    ET.SubElement(body, "freejoint", name="base")
    _inertial(body, link)
    return body


def _body(
    parent: ET.Element,
    joints: Sequence[Joint],
    friction: dict[str, float],
    limits: dict[str, JointLimits],
) -> ET.Element:
    """Append and return the body that these joints move; only the last joint has a link."""
    last = joints[-1]
    assert last.link is not None
    origin = np.sum([joint.origin_m for joint in joints], axis=0)
    body = ET.SubElement(parent, "body", name=f"link of {last.name}", pos=_text(origin))
    place = -origin
    for joint in joints:
        place = place + joint.origin_m
        _joint(body, joint, place, friction.get(joint.name, 0.0), limits.get(joint.name))
    _inertial(body, last.link)
    return body


def _inertial(body: ET.Element, link: Link) -> None:
    ET.SubElement(
        body,
        "inertial",
        pos=_text(link.com_m),
        mass=repr(float(link.mass_kg)),
        fullinertia=_text(link.inertia_kg_m2),
    )


def _joint(
    body: ET.Element, joint: Joint, place: Array, friction: float, limits: JointLimits | None
) -> None:
    kind = {
        "type": "slide" if joint.prismatic else "hinge",
        "pos": _text(place),
        "axis": _text(joint.axis),
    }
    drive: dict[str, str] = {}
    spring: dict[str, str] = {}
    if joint.drive is not None:
        ratio = joint.drive.gear_ratio
        drive = {
            "armature": repr(float(joint.drive.motor_inertia / ratio**2)),
            "damping": repr(float(joint.drive.viscous_friction / ratio**2)),
            "frictionloss": repr(float(friction)),
            **({} if limits is None else _limited(limits)),
        }
    if joint.spring is not None:
        spring = {
            "stiffness": repr(float(joint.spring.stiffness)),
            "damping": repr(float(joint.spring.damping)),
        }
    if drive and spring:
        ET.SubElement(body, "joint", {"name": MOTOR + joint.name, **kind, **drive})
        drive = {}
    ET.SubElement(body, "joint", {"name": joint.name, **kind, **drive, **spring})


def _limited(limits: JointLimits) -> dict[str, str]:
    """Return the attributes of a joint that state its limits."""
    out: dict[str, str] = {}
    if limits.position is not None:
        out |= {"limited": "true", "range": _text(np.array(limits.position))}
    if limits.effort is not None:
        ends = np.array([-limits.effort, limits.effort])
        out |= {"actuatorfrclimited": "true", "actuatorfrcrange": _text(ends)}
    return out


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
