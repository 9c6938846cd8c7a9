"""Causes of a diagnosis written back to the user's model: URDF, MJCF or robot file."""

from axisight.write_back.mjcf.homes import Home, mujoco_homes
from axisight.write_back.model import Written, check_target, write_model

__all__ = ["Home", "Written", "check_target", "mujoco_homes", "write_model"]
