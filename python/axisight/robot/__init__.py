"""Robots: reading descriptions and presets, kinematics, dynamics and linearization."""

from axisight.robot.description import Drive, Joint, Link, Spring
from axisight.robot.robot import Robot, load_robot

__all__ = ["Drive", "Joint", "Link", "Robot", "Spring", "load_robot"]
