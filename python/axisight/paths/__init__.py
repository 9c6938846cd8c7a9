"""Trajectory generation: paths through joint or tool positions, run as fast as the limits allow."""

from axisight.paths.joint_path import JointPath, joint_path
from axisight.paths.plan import motion_references, plan
from axisight.paths.tool_path import tool_path

__all__ = ["JointPath", "joint_path", "motion_references", "plan", "tool_path"]
