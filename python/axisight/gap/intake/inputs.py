"""Turns the arguments of the command line into a robot and logs with roles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from axisight.arguments import usable_path
from axisight.errors import InputError
from axisight.gap.prepare.used_part import WHOLE, Used
from axisight.logs import Log, read_case, read_log
from axisight.logs.map_files import AnyMap
from axisight.logs.sources import files_of, is_folder_log
from axisight.logs.untrusted import check_log_inside
from axisight.robot import Robot, load_robot
from axisight.robot.sources import USD_SUFFIXES
from axisight.robot_import import is_model_file

# Suffixes of models that may stand first among the logs; tables (.csv) count as logs.
_MODELS = (".urdf", ".xml", ".mjcf", ".toml", *USD_SUFFIXES)
_NONE_HELD = "--validation: expected a log to hold out, or at least two logs"


@dataclass(frozen=True)
class Inputs:
    """A simulator with its file or preset, estimation logs and validation logs.

    ``simulated``: logs of the user's own simulator, in the order of estimation and validation logs.
    """

    name: str
    robot: Robot
    robot_source: Path | str
    estimation: tuple[Log, ...]
    validation: tuple[Log, ...]
    simulated: tuple[Log, ...] = ()

    def files(self) -> list[Path]:
        """Return the files of simulator and logs."""
        logs = (*self.estimation, *self.validation, *self.simulated)
        parts = [part for log in logs for part in files_of(log.source)]
        return [Path(self.robot_source), *parts]


def read_inputs(
    paths: Sequence[Path],
    model: str | None,
    validation: Sequence[Path],
    columns: AnyMap | Path | None,
    load: Callable[..., Robot] = load_robot,
    used: Used = WHOLE,
    simulated: Sequence[Path] = (),
    *,
    bare: Callable[..., Robot] = load_robot,
    untrusted: bool = False,
    max_bytes: int | None = None,
) -> Inputs:
    """Read a case folder, or logs with a model.

    ``load`` makes a robot of the model; ``bare`` makes a robot that is only used to read logs. Without
    ``model`` the first path may be the model.

    - ``validation``: by default the last of several logs is held out; of one log that is cut into runs, its
      last run.
    - ``used``: the used part of each log; ``simulated``: logs of the user's own simulator.
    - ``untrusted``: as in `read_case`, and for logs as in `check_log_inside`; ``max_bytes``: as in `read_log`.

    Raises InputError if no log is left to hold out, the model is missing, or nothing of a log can be used.
    """
    paths = [usable_path(path, InputError) for path in paths]
    for path in (*paths, *validation, *simulated) if untrusted else ():
        if not path.is_dir() or is_folder_log(path):
            check_log_inside(path)
    read = _read(
        paths, model, validation, columns, (load, bare), untrusted, max_bytes, runs=used.runs
    )
    sims = [
        read_log(p, columns, robot=read.robot, max_bytes=max_bytes, currents=True)
        for p in simulated
    ]
    read = replace(read, simulated=tuple(sims))
    return read if used.whole else _used(read, used)


def _used(read: Inputs, used: Used) -> Inputs:
    """Return the inputs with the used part of each log; a simulator's log is cut at the times of its measured log."""
    logs = (*read.estimation, *read.validation)
    sims = list(read.simulated)
    if len(sims) == len(logs):
        sims = [one for log, sim in zip(logs, sims, strict=True) for one in used.beside(log, sim)]
    fitted = [one for log in read.estimation for one in used.of(log)]
    held = [one for log in read.validation for one in used.of(log)]
    if not held and len(fitted) < 2:
        raise InputError(_NONE_HELD)
    held = held or [fitted.pop()]
    return replace(read, estimation=tuple(fitted), validation=tuple(held), simulated=tuple(sims))


def read_beside(
    model: str,
    paths: Sequence[Path],
    columns: AnyMap | Path | None,
    load: Callable[..., Robot] = load_robot,
    *,
    bare: Callable[..., Robot] = load_robot,
    max_bytes: int | None = None,
    currents: bool = False,
) -> tuple[Robot, list[Log]]:
    """Return the robot of a file or preset, and logs of it.

    ``load`` makes the robot. Logs beside a model file are read with the robot from ``bare``. ``columns``,
    ``max_bytes`` and ``currents`` as in `read_log`. Raises LogError for a log of another robot.
    """
    # A model file needs a sample time, which stands in the logs, and these need the axes of the model.
    robot = bare(model) if is_model_file(model) else load(model)
    logs = [
        read_log(p, columns, robot=robot, max_bytes=max_bytes, currents=currents) for p in paths
    ]
    return _loaded(load, model, logs) if is_model_file(model) else robot, logs


def _loaded(load: Callable[..., Robot], source: Path | str, logs: Sequence[Log]) -> Robot:
    """Return a robot; a model file gets the sample time of its logs, unless its drive data state one."""
    if not is_model_file(source):
        return load(source)
    return load(source, sample_time_s=logs[0].sample_time_s)


def _read(
    paths: Sequence[Path],
    model: str | None,
    validation: Sequence[Path],
    columns: AnyMap | Path | None,
    loads: tuple[Callable[..., Robot], Callable[..., Robot]],
    untrusted: bool,
    max_bytes: int | None,
    *,
    runs: bool,
) -> Inputs:
    load, bare = loads
    if model is None and paths and paths[0].suffix.lower() in _MODELS:
        model, paths = str(paths[0]), paths[1:]
        if not paths:
            raise InputError(f"{model}: expected logs beside the model, got none")
    if len(paths) == 1 and paths[0].is_dir() and not is_folder_log(paths[0]):
        own = bare if model is None else load_robot
        case = read_case(
            paths[0], columns, untrusted=untrusted, max_bytes=max_bytes, load=own, currents=True
        )
        source = model if model is not None else case.robot_path
        robot = _loaded(load, source, case.logs)
        extra = [
            read_log(p, columns, robot=robot, max_bytes=max_bytes, currents=True)
            for p in validation
        ]
        return Inputs(case.name, robot, source, tuple(case.estimation), (*case.validation, *extra))
    if model is None:
        if paths and not paths[0].exists() and not is_folder_log(paths[0]):
            raise InputError(f"{paths[0]}: expected a case folder or a log, got nothing")
        raise InputError(
            "--model: expected a robot.toml, a URDF, an MJCF or a preset when logs are given, got nothing"
        )
    robot, read = read_beside(
        model, [*paths, *validation], columns, load, bare=bare, max_bytes=max_bytes, currents=True
    )
    logs, held = read[: len(paths)], read[len(paths) :]
    if not held:
        if len(logs) < 2 and not runs:
            raise InputError(_NONE_HELD)
        held = [logs.pop()] if len(logs) > 1 else []
    # The case is named after the robot, not after its first log.
    return Inputs(robot.name or Path(model).stem, robot, model, tuple(logs), tuple(held))
