"""Functions that need a fixed base."""

from __future__ import annotations

from axisight.errors import RobotError
from axisight.robot.robot import Robot


def refuse_floating(robot: Robot, needed_by: str) -> None:
    """Raise RobotError for a robot with a floating base; ``needed_by`` says what needs a fixed one."""
    if robot.floating_base is not None:
        raise RobotError(
            f"robot {robot.name!r}: expected a fixed base, which {needed_by} needs, got a floating one. Import the "
            f"model without floating, or remove [base] from the robot file; identify_floating takes floating bases"
        )
