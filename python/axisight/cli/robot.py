"""What commands that simulate a robot share: it comes with its effects, and a line says so."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from axisight.cli.common import OUT
from axisight.effects import Effect
from axisight.robot import Robot, load_robot
from axisight.robot_file import refuse_effects_beside


def load_simulator(source: Path | str, given: Iterable[Effect] = ()) -> Robot:
    """Return the robot to simulate, and say which effects of its own act; see `say_effects`."""
    robot = load_robot(source)
    say_effects(robot, source, given)
    return robot


def say_effects(robot: Robot, source: Path | str, given: Iterable[Effect] = ()) -> None:
    """Print which effects a robot has, but for those that ``given`` ones replace.

    Raises InputError as `refuse_effects_beside`.
    """
    refuse_effects_beside(source, robot)
    replaced = {effect.label for effect in given}
    acting = [e.label for e in robot.effects if e.acts and e.label not in replaced]
    if acting:
        text = f"with the effects of {source}: {', '.join(acting)}"
        OUT.print(text, markup=False, highlight=False, soft_wrap=True)
