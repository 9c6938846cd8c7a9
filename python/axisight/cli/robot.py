"""What commands that simulate a robot share: the effects that identification put beside its file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import OUT
from axisight.effects import Effect
from axisight.robot import Robot, load_robot
from axisight.robot_file import load_with_effects

OPTION = "--no-identified-effects"

IdentifiedEffects = Annotated[
    bool,
    typer.Option(
        f"--identified-effects/{OPTION}",
        help="Simulate with the effects in NAME.identified.json beside the robot file.",
    ),
]


def load_simulator(source: Path | str, given: Iterable[Effect] = (), *, identified: bool) -> Robot:
    """Return the robot to simulate; a line says which effects its sidecar adds.

    ``given`` effects go before those of the sidecar. Raises as `load_with_effects`.
    """
    if not identified:
        return load_robot(source)
    robot, line = load_with_effects(source, given)
    if line:
        hint = f" ({OPTION} does without)" if robot.effects else ""
        OUT.print(line + hint, markup=False, highlight=False, soft_wrap=True)
    return robot
