"""Functions that need a fixed base."""

from __future__ import annotations

from axisight.robot.dynamics import need_fixed_base
from axisight.robot.robot import Robot


def refuse_floating(robot: Robot, needed_by: str) -> None:
    """Raise RobotError for a robot with a floating base; ``needed_by`` says what needs a fixed one."""
    advice = "import the model without floating, or remove [base] from the robot file"
    need_fixed_base(robot.core, needed_by, f"{advice}; identify_floating takes floating bases")
