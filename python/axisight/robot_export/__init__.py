"""Robots as models of other libraries: Pinocchio, MuJoCo. What these cannot say stands in their notes."""

from axisight.robot_export.mujoco_model import mjcf, to_mujoco
from axisight.robot_export.pinocchio_model import to_pinocchio

__all__ = ["mjcf", "to_mujoco", "to_pinocchio"]
