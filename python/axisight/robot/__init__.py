"""The robot: read from a description or a preset, its kinematics, dynamics and linearization."""

from axisight.robot.robot import Robot, load_robot

__all__ = ["Robot", "load_robot"]
