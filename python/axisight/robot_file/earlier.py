"""Sidecars of version 1, which hold effects that version 2 states in the robot file."""

from __future__ import annotations

from pathlib import Path

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot.presets import PRESETS
from axisight.robot_file.checks import check_effects
from axisight.robot_file.sidecar import Earlier, Sidecar, read_sidecar, sidecar_path


def with_earlier_effects(robot: Robot, report: Sidecar | Earlier) -> Robot:
    """Return a robot with the effects of its sidecar, if that is of version 1.

    Effects in the robot file take precedence, because such a file is newer than the sidecar. Raises
    RobotError and InputError for effects that the robot cannot have.
    """
    if isinstance(report, Sidecar) or robot.effects:
        return robot
    effects = [Effect(e.name, e.axis, e.parameters) for e in report.effects]
    check_effects(effects, robot.n_axes)
    return robot.with_effects(effects)


def refuse_effects_beside(source: Path | str, robot: Robot) -> None:
    """Raise InputError if the effects of a robot are in a sidecar of version 1, where nothing reads them.

    ``source`` is the file of the ``robot``, or the name of a preset. The message says how to move the effects
    into the robot file. A sidecar that cannot be read is ignored.
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
