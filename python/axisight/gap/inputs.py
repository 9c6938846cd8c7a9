"""What a user hands over on the command line, turned into a robot and logs with roles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from axisight.errors import InputError
from axisight.logs import Log, read_case, read_log
from axisight.robot import Robot, load_robot


@dataclass(frozen=True)
class Inputs:
    """A simulator, the logs to fit and choose on, and those for the final figures."""

    name: str
    robot: Robot
    estimation: tuple[Log, ...]
    validation: tuple[Log, ...]


def read_inputs(
    paths: Sequence[Path],
    model: str | None,
    validation: Sequence[Path],
    columns: Path | None,
    load: Callable[[Path | str], Robot] = load_robot,
) -> Inputs:
    """Read a case folder, or logs with a model, which ``load`` turns into a robot.

    Without ``validation`` the last of several logs is held out. Raises
    InputError when nothing is left to hold out or the model is missing.
    """
    if len(paths) == 1 and paths[0].is_dir():
        case = read_case(paths[0], columns)
        robot = load(model if model is not None else case.robot_path)
        extra = tuple(read_log(p, columns, n_axes=robot.n_axes) for p in validation)
        return Inputs(case.name, robot, tuple(case.estimation), (*case.validation, *extra))
    if model is None:
        raise InputError(
            "--model: expected a robot.toml or a preset when logs are given, got nothing"
        )
    robot = load(model)
    logs = [read_log(p, columns, n_axes=robot.n_axes) for p in paths]
    held = [read_log(p, columns, n_axes=robot.n_axes) for p in validation]
    if not held:
        if len(logs) < 2:
            raise InputError("--validation: expected a log to hold out, or at least two logs")
        held = [logs.pop()]
    return Inputs(paths[0].stem, robot, tuple(logs), tuple(held))
