"""Trajectory generation: paths through joint or tool positions, as fast as limits allow; their files."""

from axisight.paths.joint_path import JointPath, joint_path
from axisight.paths.plan import motion_references, plan
from axisight.paths.tool_path import tool_path
from axisight.paths.trajectory import JointTrajectory, joint_trajectory, write_joint_trajectory

__all__ = [
    "JointPath",
    "JointTrajectory",
    "joint_path",
    "joint_trajectory",
    "motion_references",
    "plan",
    "tool_path",
    "write_joint_trajectory",
]
