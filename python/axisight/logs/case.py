"""A gap case folder, `axisight.case/1`: one simulator, its measured logs and their roles."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.arguments import counted, shown, usable_path
from axisight.display import html
from axisight.display.summary import summarized
from axisight.documents import parse_toml, read_text
from axisight.errors import CaseError
from axisight.logs.columns import describe_validation
from axisight.logs.log import Log
from axisight.logs.map_files import AnyMap, load_column_map, needs_robot
from axisight.logs.reading import read_log
from axisight.logs.sources import is_folder_log
from axisight.logs.sources_bag import is_bag
from axisight.logs.untrusted import check_folder, check_log_inside, check_name
from axisight.logs.validate import check_same_rate
from axisight.robot import Robot, load_robot

Role = Literal["estimation", "validation"]
Text = Annotated[str, Field(min_length=1)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _LogEntry(_Strict):
    file: Text
    role: Role
    excitation: str | None = None
    period_s: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None


class _CaseFile(_Strict):
    schema_: Literal["axisight.case/1"] = Field(alias="schema")
    name: Text
    robot: Text
    log: tuple[_LogEntry, ...] = ()


@summarized
@dataclass(frozen=True, eq=False)
class Case:
    """A case with its logs in the file's order; `roles` runs parallel to `logs`."""

    name: str
    folder: Path
    robot_path: Path
    logs: tuple[Log, ...]
    roles: tuple[Role, ...]

    def _repr_html_(self) -> str:
        """Return a table of the logs and their roles as HTML, for notebooks."""
        rows = [
            (
                log.name,
                role,
                f"{log.duration_s:g} s",
                f"{log.sample_rate_hz:.6g} Hz",
                str(log.n_axes),
            )
            for log, role in zip(self.logs, self.roles, strict=True)
        ]
        head = ("log", "for", "duration", "rate", "axes")
        return html.page(
            self.name, html.table(head, rows, "Logs"), html.lines([f"robot {self.robot_path}"])
        )

    @property
    def estimation(self) -> tuple[Log, ...]:
        """Logs for fitting and choosing."""
        return self._with_role("estimation")

    @property
    def validation(self) -> tuple[Log, ...]:
        """Logs for the final figures only."""
        return self._with_role("validation")

    def _with_role(self, role: Role) -> tuple[Log, ...]:
        return tuple(log for log, own in zip(self.logs, self.roles, strict=True) if own == role)


def read_case(
    folder: Path | str,
    columns: AnyMap | Path | str | None = None,
    *,
    untrusted: bool = False,
    max_bytes: int | None = None,
    load: Callable[..., Robot] = load_robot,
    currents: bool = False,
) -> Case:
    """Return the case in `folder`, with every log that its `case.toml` lists.

    `columns` is the column map for logs without native columns.

    `columns`, `max_bytes` and `currents` are as in `read_log`; `max_bytes` holds for each log separately.
    ``untrusted``: refuse everything that leads out of the folder, for cases from strangers. These are
    absolute names, names with ``..``, links that lead out, and HDF5 files that refer to other files.
    ``load``: function that returns the robot for the path in the case. Its gear ratios convert joint-side
    signals, its torque constants convert currents.

    Raises CaseError, naming file and field, for a missing or invalid case.toml, unknown keys, a missing robot
    file, a case without estimation logs, and a file listed twice. Raises CaseError for logs with different
    numbers of axes, and for a period that is not a whole number of samples or exceeds the log. Raises
    LogError for a log that cannot be read or has another sample rate.
    """
    folder = usable_path(folder, CaseError)
    path = folder / "case.toml"
    if untrusted:
        check_folder(folder)
    content = _parse(path)
    if untrusted:
        _check_names(path, content)
    robot_path = folder / usable_path(content.robot, CaseError, f"{path}: robot")
    if not robot_path.is_file():
        raise CaseError(f"{path}: robot: expected an existing file, got {shown(content.robot)}")
    if not any(entry.role == "estimation" for entry in content.log):
        raise CaseError(
            f"{path}: log: expected at least one with role 'estimation', got none among "
            f"{counted(len(content.log), 'log')}"
        )
    seen: set[Path] = set()
    for number, entry in enumerate(content.log):
        usable_path(entry.file, CaseError, f"{path}: log {number + 1}: file")
        file = (folder / entry.file).resolve()
        if file in seen:
            raise CaseError(
                f"{path}: log {number + 1}: file: expected a new file, got {shown(entry.file)} again"
            )
        seen.add(file)
    given = load_column_map(columns) if isinstance(columns, str | Path) else columns
    # Motor-side logs need no robot, so a faulty robot file is not reported here but where it is used.
    needed = given is not None and needs_robot(given)
    recorded = any(
        is_bag(folder / entry.file) or is_folder_log(folder / entry.file) for entry in content.log
    )
    robot = load(robot_path) if needed or recorded else None
    logs = tuple(
        _read_entry(path, number, entry, given, robot, max_bytes, currents)
        for number, entry in enumerate(content.log)
    )
    for number, log in enumerate(logs):
        if log.n_axes != logs[0].n_axes:
            raise CaseError(
                f"{path}: log {number + 1}: file: expected {logs[0].n_axes} axes as in the first log, "
                f"got {log.n_axes}"
            )
    check_same_rate(logs)
    roles = tuple(entry.role for entry in content.log)
    return Case(content.name, folder, robot_path, logs, roles)


def _check_names(path: Path, content: _CaseFile) -> None:
    """Raise CaseError or LogError for names that lead out of the case folder (`untrusted` in `read_case`)."""
    check_name(content.robot, f"{path}: robot")
    for number, entry in enumerate(content.log):
        check_name(entry.file, f"{path}: log {number + 1}: file")
        check_log_inside(path.parent / entry.file)


def _parse(path: Path) -> _CaseFile:
    try:
        return _CaseFile.model_validate(parse_toml(read_text(path)))
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{path}: cannot be read: {error}") from error
    except ValidationError as error:
        raise CaseError(f"{path}: {describe_validation(error, _CaseFile)}") from error
    except ValueError as error:
        raise CaseError(f"{path}: expected TOML, got: {error}") from error


def _read_entry(
    path: Path,
    number: int,
    entry: _LogEntry,
    columns: AnyMap | None,
    robot: Robot | None,
    max_bytes: int | None,
    currents: bool,
) -> Log:
    file = path.parent / entry.file
    if not file.is_file() and not is_folder_log(file):
        raise CaseError(
            f"{path}: log {number + 1}: file: expected an existing file, got {shown(entry.file)}"
        )
    log = read_log(file, columns, robot=robot, max_bytes=max_bytes, currents=currents)
    if entry.period_s is not None:
        samples = entry.period_s / log.sample_time_s
        if not np.isfinite(samples) or round(samples) < 1 or abs(samples - round(samples)) > 0.01:
            raise CaseError(
                f"{path}: log {number + 1}: period_s: expected a whole number of samples, got "
                f"{samples:.6g}"
            )
        if round(samples) > log.n_samples:
            raise CaseError(
                f"{path}: log {number + 1}: period_s: expected at most the log's {log.duration_s:g} s, "
                f"got {entry.period_s:g} s"
            )
    return dataclasses.replace(log, excitation=entry.excitation, period_s=entry.period_s)
