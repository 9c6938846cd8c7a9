"""Robots: reading descriptions and presets, kinematics, dynamics and linearization."""

from axisight.robot.accelerometer import Accelerometer
from axisight.robot.base_motion import BaseMotion
from axisight.robot.description import Drive, Joint, Link, Spring
from axisight.robot.limits import JointLimits
from axisight.robot.loading import load_robot
from axisight.robot.robot import Robot

__all__ = [
    "Accelerometer",
    "BaseMotion",
    "Drive",
    "Joint",
    "JointLimits",
    "Link",
    "Robot",
    "Spring",
    "load_robot",
]
