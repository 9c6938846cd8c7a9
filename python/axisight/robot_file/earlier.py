"""Sidecars of version 1: they hold effects that belong into the robot file now."""

from __future__ import annotations

from pathlib import Path

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot.presets import PRESETS
from axisight.robot_file.checks import check_effects
from axisight.robot_file.sidecar import Earlier, Sidecar, read_sidecar, sidecar_path


def with_earlier_effects(robot: Robot, report: Sidecar | Earlier) -> Robot:
    """Return the robot of a sidecar, with the effects in one of version 1.

    A robot file that states effects was written since: it has the last word. Raises RobotError
    and InputError for effects that the robot cannot have.
    """
    if isinstance(report, Sidecar) or robot.effects:
        return robot
    effects = [Effect(e.name, e.axis, e.parameters) for e in report.effects]
    check_effects(effects, robot.n_axes)
    return robot.with_effects(effects)


def refuse_effects_beside(source: Path | str, robot: Robot) -> None:
    """Refuse a robot whose effects stand in a sidecar of version 1: it would go without them.

    ``source`` is the file of the ``robot``, or the name of a preset. Raises InputError that says how
    to bring them into the robot file. A sidecar that cannot be read takes nothing from the robot.
    """
    path = sidecar_path(source)
    if robot.effects or (isinstance(source, str) and source in PRESETS) or not path.is_file():
        return
    try:
        report = read_sidecar(path)
    except InputError:
        return
    if isinstance(report, Sidecar):
        return
    effects = [Effect(e.name, e.axis, e.parameters) for e in report.effects]
    acting = ", ".join(effect.label for effect in effects if effect.acts)
    if acting:
        raise InputError(
            f"{path}: expected effects in the robot file, got {acting} beside it, as earlier "
            "versions wrote them. Write both again: found = load_identified(file); "
            "write_identified(found.robot, file, found, overwrite=True), of axisight.robot_file"
        )
