"""Branches of a robot: joints that do not sit on the link of the joint before them."""

from __future__ import annotations

from axisight.errors import RobotError
from axisight.robot.robot import Robot


def refuse_branches(robot: Robot, needed_by: str) -> None:
    """Raise RobotError for a robot with branches; ``needed_by`` says what needs a chain, for the message."""
    if robot.is_chain:
        return
    joints = robot.joints
    branch = next(i for i, j in enumerate(joints) if j.parent != (i - 1 if i else None))
    parent = joints[branch].parent
    raise RobotError(
        f"robot {robot.name!r}: expected one chain, which {needed_by} needs, got branches: {joints[branch].name} "
        f"is on {'the base' if parent is None else joints[parent].name}. Cut out one chain of the model file by "
        f"--tip, or by tip = '...' in its drive data; the other branches are then locked at zero"
    )
