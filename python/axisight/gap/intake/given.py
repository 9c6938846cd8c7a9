"""Turns the arguments of `axisight.diagnose` into a simulator and logs with roles."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from axisight.arguments import shown, usable_path
from axisight.errors import CaseError, InputError
from axisight.gap.facts.settings import Settings
from axisight.logs import AnyMap, Case, Log, read_case, read_log
from axisight.logs.sources import LOG_SUFFIXES, is_folder_log, suffix_of
from axisight.logs.tables import is_table, log_of_table
from axisight.robot import Robot, load_robot
from axisight.robot.presets import PRESETS
from axisight.robot.sources import MODEL_SUFFIXES

# Suffixes of robot files; tables (.csv) may be logs.
_ROBOTS = {*MODEL_SUFFIXES, ".toml"} - {".csv"}
_HOW = "diagnose(robot, logs, validation=...)"
_ONE_LOG = (
    "validation: expected logs to hold out, or at least two logs, got one log; "
    "log.part(0, 20) and log.part(20) make two of it"
)


@dataclass(frozen=True)
class Given:
    """A simulator or its source, and logs with roles.

    ``says``: sentences about choices that the caller did not make.
    """

    name: str
    source: Robot | Path | str
    estimation: list[Log]
    validation: list[Log]
    simulated: list[Log]
    says: tuple[str, ...] = ()


def given_inputs(
    first: object,
    logs: object,
    robot: object,
    estimation: object,
    validation: object,
    simulated: object,
    columns: AnyMap | Path | str | None,
) -> Given:
    """Return simulator and logs from the arguments of `diagnose`, of which ``first`` is ``case``.

    Without validation logs, the last of several ``logs`` is held out. Raises InputError naming an argument that
    is missing, of another type, or given twice; CaseError if a role has no log; LogError for a log that cannot
    be read. A path stands for a log if it has the suffix of one; otherwise for a case: its folder or its
    ``case.toml``. ``columns`` holds for every log that is read, those of a case folder included.
    """
    if (
        isinstance(first, Case)
        and columns is not None
        and not (_some(validation) or _some(simulated))
    ):
        raise InputError(
            "columns: expected none beside a Case, whose logs are read already, got a column map; "
            "read_case(folder, columns) takes one"
        )
    case, source, logs = _sorted_out(first, logs, robot, estimation, columns)
    if case is not None:
        source = case.robot_path if source is None else source
        read = _Reader(source, columns)
        held = [*case.validation, *read.logs("validation", validation)]
        sims = read.logs("simulated", simulated)
        return _with_both(Given(case.name, source, list(case.estimation), held, sims))
    if source is None:
        raise InputError(
            f"diagnose: expected a case, or a robot with estimation and validation logs: {_HOW}"
        )
    read = _Reader(source, columns)
    held, sims = read.logs("validation", validation), read.logs("simulated", simulated)
    if logs is None:
        fitted = read.logs("estimation", estimation)
        return _with_both(Given("logs", source, fitted, held, sims))
    fitted = read.logs("logs", logs)
    says: tuple[str, ...] = ()
    if not held and len(fitted) == 1:
        raise InputError(_ONE_LOG)
    if not held and fitted:
        held = [fitted.pop()]
        says = (f"No validation logs were given: the last log, {held[0].name!r}, is held out.",)
    return _with_both(Given("logs", source, fitted, held, sims, says))


def check_options(settings: object) -> None:
    """Raise InputError if the settings have another type."""
    if settings is not None and not isinstance(settings, Settings):
        raise InputError(f"settings: expected Settings, got {shown(settings)}")


def _sorted_out(
    first: object,
    logs: object,
    robot: object,
    estimation: object,
    columns: AnyMap | Path | str | None,
) -> tuple[Case | None, Robot | Path | str | None, object]:
    """Return the case, the simulator and the logs to split; None for each that was not given."""
    chosen = None if robot is None else _robot("robot", robot)
    some = _some(estimation)
    if logs is not None and some:
        raise InputError("estimation: expected logs, or estimation, got both")
    if first is None:
        return None, chosen, logs
    if isinstance(first, Robot) or (_is_path(first) and (logs is not None or some)):
        if chosen is not None:
            raise InputError("robot: expected one robot, got one first and one by name")
        if logs is None and not some:
            _no_logs(first)
        return None, _robot("robot", first), logs
    if isinstance(first, Case) or _is_path(first):
        path = usable_path("" if isinstance(first, Case) else str(first), CaseError)
        if _is_path(first) and chosen is not None and _is_log(path):
            return None, chosen, [path]
        if logs is not None or some:
            raise InputError("logs: expected none beside a case, which has its own, got some")
        if isinstance(first, Case):
            return first, chosen, None
        folder = _case_folder(path, alone=chosen is None)
        return read_case(folder, columns, currents=True), chosen, None
    if isinstance(first, Log) or is_table(first) or isinstance(first, Iterable):
        if isinstance(logs, Robot) or chosen is None:
            raise InputError(f"robot: expected the robot first, {_HOW}, got {_kind(first)}")
        if logs is not None or some:
            raise InputError("logs: expected logs once, got them twice")
        return None, chosen, first
    raise InputError(
        f"case: expected a case folder, or a robot with logs ({_HOW}), got {shown(first)}"
    )


def _is_log(path: Path) -> bool:
    """Whether a path stands for a log: by its suffix, or as the folder of a recording."""
    return is_folder_log(path) or (suffix_of(path) in LOG_SUFFIXES and not path.is_dir())


def _case_folder(path: Path, *, alone: bool) -> Path:
    """Return the folder of a case.

    ``alone``: no robot was given; raises InputError for a robot without logs, or a log without a robot.
    """
    if path.name == "case.toml" and not path.is_dir():
        return path.parent
    if alone and not path.is_dir() and (str(path) in PRESETS or path.suffix.lower() in _ROBOTS):
        _no_logs(path)
    if alone and _is_log(path):
        raise InputError(f"robot: expected a robot beside the log {path}, {_HOW}, got none")
    return path


def _no_logs(robot: object) -> None:
    """Raise InputError for a robot without logs."""
    name = robot.name if isinstance(robot, Robot) else robot
    raise InputError(f"logs: expected logs beside the robot {str(name)!r}, {_HOW}, got none")


def _is_path(value: object) -> bool:
    return isinstance(value, str | PathLike)


def _some(value: object) -> bool:
    """Whether logs were given; None and an empty list are none."""
    return value is not None and not (isinstance(value, tuple | list) and not value)


def _kind(value: object) -> str:
    return "logs" if isinstance(value, Log) or is_table(value) else f"a {type(value).__name__}"


def _robot(field: str, value: object) -> Robot | Path | str:
    if isinstance(value, Robot | str):
        return value
    if isinstance(value, PathLike):
        return Path(value)
    raise InputError(f"{field}: expected a Robot, a preset or a path, got {shown(value)}")


def _with_both(given: Given) -> Given:
    """Return the inputs; raise CaseError if a role has no log."""
    if not given.estimation or not given.validation:
        raise CaseError(
            f"{given.name}: expected at least one estimation and one validation log, "
            f"got {len(given.estimation)} and {len(given.validation)}"
        )
    return given


class _Reader:
    """Reads logs of a robot from any accepted form; the robot is loaded when the first log needs it."""

    def __init__(self, source: Robot | Path | str, columns: AnyMap | Path | str | None) -> None:
        self._source = source
        self._columns = columns
        self._loaded: Robot | None = source if isinstance(source, Robot) else None

    def logs(self, field: str, given: object) -> list[Log]:
        """Return logs, given as one or as several; raise InputError naming the field and the place."""
        if given is None:
            return []
        if isinstance(given, Log) or _is_path(given) or is_table(given):
            return [self._one(field, given, field.rstrip("s"))]
        if isinstance(given, Case):
            raise InputError(f"{field}: expected logs, got a Case; diagnose(case) takes it whole")
        if not isinstance(given, Iterable):
            raise InputError(f"{field}: expected logs ({_LOGS}), got {shown(given)}")
        each = list(given)
        stem = "log" if field in {"logs", "estimation"} else field
        return [self._one(f"{field}[{k}]", one, f"{stem}{k + 1}") for k, one in enumerate(each)]

    def _one(self, field: str, given: Any, name: str) -> Log:
        if isinstance(given, Log):
            return given
        if _is_path(given):
            path = usable_path(given, InputError, field)
            return read_log(path, self._columns, robot=self._robot(), currents=True)
        if is_table(given):
            named = getattr(given, "attrs", {}).get("name", name)
            robot = self._robot()
            return log_of_table(given, self._columns, name=str(named), robot=robot, currents=True)
        raise InputError(f"{field}: expected a log ({_LOGS}), got {shown(given)}")

    def _robot(self) -> Robot:
        if self._loaded is None:
            self._loaded = load_robot(self._source)  # type: ignore[arg-type]
        return self._loaded


_LOGS = "a path, a Log, a DataFrame or a Dataset"
