"""A robot as a MuJoCo model: gears as two joints in series, rotors as armature."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from axisight.errors import MissingExtraError
from axisight.robot import Robot
from axisight.robot.description import Joint
from axisight.robot_export.dry_friction import joint_friction_nm

Array = NDArray[np.float64]

MOTOR = "motor of "
"""What the joint of a motor on an elastic gear is called before the name of the driven joint."""


def to_mujoco(robot: Robot) -> Any:
    """Return the ``mujoco.MjModel`` of `mjcf`. Raises MissingExtraError without MuJoCo."""
    try:
        mujoco = import_module("mujoco")
    except ImportError as error:
        raise MissingExtraError("to_mujoco needs MuJoCo: pip install 'axisight[mujoco]'") from error
    return mujoco.MjModel.from_xml_string(mjcf(robot))


def mjcf(robot: Robot) -> str:
    """Return a robot as an MJCF text, angles as its own.

    A driven joint with a rigid gear is a hinge (or slide) with the rotor as ``armature``, J_m / r^2, viscous
    friction as ``damping``, F_v / r^2, and Coulomb friction as ``frictionloss``. One with an elastic gear is two in
    series: ``motor of NAME``, the motor angle times r with what the drive has, and NAME with stiffness and
    damping of the gear, whose angle is that of the arm minus the motor's. Motors take motor torque [Nm].
    Massless links share a body with the next. Ripples, backlash and all other effects, and the
    controller, have no place there.
    """
    root = ET.Element("mujoco", model=robot.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="false")
    ET.SubElement(
        root, "option", gravity=_text(robot.gravity_m_s2), timestep=repr(robot.sample_time_s)
    )
    body = ET.SubElement(root, "worldbody")
    friction = joint_friction_nm(robot)
    waiting: list[Joint] = []
    for joint in robot.joints:
        waiting.append(joint)
        if joint.link is not None:
            body = _body(body, waiting, friction)
            waiting = []
    actuators = ET.SubElement(root, "actuator")
    for name, ratio, rigid in zip(
        robot.axis_names, robot.gear_ratio.tolist(), robot.axis_is_rigid, strict=True
    ):
        driven = name if rigid else MOTOR + name
        ET.SubElement(actuators, "motor", name=name, joint=driven, gear=repr(1.0 / ratio))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _body(parent: ET.Element, joints: Sequence[Joint], friction: dict[str, float]) -> ET.Element:
    """Append the body that several joints, all but the last without a link, move; return it."""
    last = joints[-1]
    assert last.link is not None
    origin = np.sum([joint.origin_m for joint in joints], axis=0)
    body = ET.SubElement(parent, "body", name=f"link of {last.name}", pos=_text(origin))
    place = -origin
    for joint in joints:
        place = place + joint.origin_m
        _joint(body, joint, place, friction.get(joint.name, 0.0))
    ET.SubElement(
        body,
        "inertial",
        pos=_text(last.link.com_m),
        mass=repr(float(last.link.mass_kg)),
        fullinertia=_text(last.link.inertia_kg_m2),
    )
    return body


def _joint(body: ET.Element, joint: Joint, place: Array, friction: float) -> None:
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


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
