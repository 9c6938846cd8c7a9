"""Branches of a robot: joints that do not sit on the link of the joint before them."""

from __future__ import annotations

from axisight.errors import RobotError
from axisight.robot.robot import Robot


def neighbouring_axes(robot: Robot) -> list[tuple[int, int]]:
    """Return each axis (from 1) with the one that carries it, that one first; axes on the base have none."""
    below = carriers(robot)
    return [(chain[-2], axis) for axis, chain in below.items() if len(chain) > 1]


def tips(robot: Robot) -> list[int]:
    """Return the axes (from 1) that carry a link and no other axis."""
    carrying = {first for first, _ in neighbouring_axes(robot)}
    return [
        axis
        for axis in robot.axis_numbers()
        if axis not in carrying and robot.axis_parameter(axis, "mass") is not None
    ]


def carriers(robot: Robot) -> dict[int, tuple[int, ...]]:
    """Return by axis (from 1) the axes from the base to it, with itself: those that feel its link."""
    joints, driven = robot.joints, robot.axis_joints
    number = {joint: axis for axis, joint in enumerate(driven, 1)}

    def path(joint: int | None) -> tuple[int, ...]:
        if joint is None:
            return ()
        before = path(joints[joint].parent)
        return (*before, number[joint]) if joint in number else before

    return {axis: path(joint) for axis, joint in enumerate(driven, 1)}


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
