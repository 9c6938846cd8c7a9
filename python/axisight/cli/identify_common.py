"""Shared parts of the commands ``axisight identify``: reading logs, writing the robot, naming options."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from axisight.cli.common import numbers, say
from axisight.cli.panels import ADVANCED, EXCITATION
from axisight.errors import AxisightError, InputError, OutputError
from axisight.gap import RefusedInputError, check_fit_inputs
from axisight.gap.facts.faults import refused
from axisight.gap.prepare.used_part import WHOLE, Used
from axisight.logs import Log, check_log, read_log
from axisight.logs.map_files import column_file
from axisight.logs.sources import files_of
from axisight.robot import Robot, load_robot
from axisight.robot_file import (
    Identified,
    Provenance,
    hash_file,
    refuse_effects_beside,
    sidecar_path,
    write_identified,
)
from axisight.storage import check_targets

Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        "-o",
        help="Robot file to write. NAME.identified.json beside it has standard errors, data and settings.",
    ),
]
Unchecked = Annotated[
    bool,
    typer.Option(
        "--unchecked",
        rich_help_panel=ADVANCED,
        help="Take logs in which 'axisight check' finds errors.",
    ),
]
PeriodS = Annotated[
    float | None,
    typer.Option(rich_help_panel=EXCITATION, help="Period of the excitation (s). Default: found."),
]
ExcitedBand = Annotated[
    str | None,
    typer.Option(
        metavar="LOW,HIGH",
        rich_help_panel=EXCITATION,
        help="Band of the excited lines (Hz); needs --period-s. Default: found from the reference, "
        "else from the torque.",
    ),
]
DropPeriods = Annotated[
    int | None,
    typer.Option(rich_help_panel=EXCITATION, help="Periods to drop as transient. Default: found."),
]


def load_source(robot: str) -> Robot:
    """Return the robot of a preset or a file, with the effects that the file states.

    Raises RobotError as `load_robot`, InputError as `refuse_effects_beside`.
    """
    machine = load_robot(robot)
    refuse_effects_beside(robot, machine)
    return machine


def read_logs(
    paths: Sequence[Path],
    columns: Path | None,
    robot: Robot | None,
    *,
    unchecked: bool,
    used: Used = WHOLE,
    broadband: bool = False,
) -> list[Log]:
    """Return the ``used`` part of logs that pass ``axisight check``; print its warnings.

    The check is needed because identification also fits data in wrong units or with missing rows. Raises
    InputError for errors of the check and faults that :func:`check_fit_inputs` refuses, unless ``unchecked``.
    ``broadband``: references exceed the bandwidth of the loop, so no warning says that motors do not follow.
    Raises InputError for a revolute axis where the robot has a prismatic one, and the reverse.
    """
    logs = []
    said: set[tuple[str, str]] = set()
    for path in paths:
        said |= _checked(path, columns, unchecked=unchecked, broadband=broadband)
        log = read_log(path, columns, robot=robot)
        slides = [kind == "prismatic" for kind in log.axis_kinds]
        if robot is not None and slides != list(robot.axis_is_prismatic):
            raise InputError(
                f"{path.name}: units: expected axes that {_kinds(robot.axis_is_prismatic)}, as the "
                f"robot's, got units of axes that {_kinds(slides)}; a column map (--columns) states units"
            )
        logs.append(used.one_of(log))
    found = check_fit_inputs(robot, logs)
    if refused(found) and not unchecked:
        raise InputError(f"{RefusedInputError(found)} (correct it, or go on with --unchecked)")
    for finding in found:
        if (finding.log, finding.message) not in said and finding.name != "velocity_inconsistent":
            say(f"warning: {finding}")
    return logs


def _checked(
    path: Path, columns: Path | None, *, unchecked: bool, broadband: bool
) -> set[tuple[str, str]]:
    """Print the warnings of ``axisight check`` and return them as (name of the log, message).

    Raises InputError for errors without a stable name, unless ``unchecked``. Errors with a name are refused
    later: by reading, or by the check of the used part.
    """
    said = set()
    for finding in check_log(path, columns).findings:
        if (
            broadband
            and finding.column.startswith("velocity_ref")
            and finding.severity == "warning"
        ):
            continue
        text = f"{path.name}: {finding.column}: {finding.message}"
        if finding.severity == "error" and finding.column == "file":
            raise InputError(finding.message)  # no column map would mend it
        if finding.severity == "error" and not finding.name and not unchecked:
            raise InputError(f"{text} (correct it in a column map, or go on with --unchecked)")
        if finding.severity == "warning" or (finding.severity == "error" and not finding.name):
            say(f"{finding.severity}: {f'{finding.name}: ' if finding.name else ''}{text}")
            said.add((path.stem, finding.message))
    return said


def _kinds(slides: Sequence[bool]) -> str:
    return ", ".join("slide" if one else "turn" for one in slides)


def check_out(
    out: Path | None, logs: Sequence[Path], columns: Path | None = None, *, force: bool
) -> None:
    """Raise OutputError before any work if the robot or its sidecar cannot be written.

    With ``force`` an existing robot is replaced, as it is refined from step to step. Logs and their column
    map are never replaced.
    """
    if out is None:
        return
    targets = {"--out": out, "--out, sidecar": sidecar_path(out)}
    inputs = [*logs, *(x for x in (columns,) if x)]
    check_targets(targets, inputs=inputs, replaces=dict.fromkeys(targets, ()), force=force)


def options(ctx: typer.Context) -> dict[str, Any]:
    """Return the options of a command for its provenance: numbers, choices, and names of files."""
    out: dict[str, Any] = {}
    for name, value in ctx.params.items():
        if isinstance(value, list | tuple):
            out[name] = [v.name if isinstance(v, Path) else v for v in value]
        elif name not in ("robot", "out", "plot", "force"):
            out[name] = value.name if isinstance(value, Path) else value
    return out


@contextmanager
def as_options(ctx: typer.Context) -> Iterator[None]:
    """Rephrase errors of the library for the shell, with options in place of keyword arguments."""
    try:
        yield
    except AxisightError as error:
        raise InputError(option_words(str(error), option_names(ctx))) from None


# Keyword argument in a message -> option, if the names differ.
_OPTIONS = {'deficient="group"': "--group", "`known`": "--known"}


def option_names(ctx: typer.Context) -> list[str]:
    """Return the parameter names of a command's options, without its arguments."""
    return [p.name for p in ctx.command.params if p.name and p.param_type_name == "option"]


def option_words(text: str, options: Collection[str]) -> str:
    """Return a message with ``cutoff_hz`` as ``--cutoff-hz``, and ``method="wls"`` as ``--method wls``.

    ``options`` are the parameter names of the command's options; other names stay as they are.
    """

    def given(found: re.Match[str]) -> str:
        name, value = found["name"], found["value"]
        return f"--{name.replace('_', '-')} {value}" if name in options else found[0]

    def field(found: re.Match[str]) -> str:
        name = found[1]
        return f"--{name.replace('_', '-')}: " if name in options else found[0]

    for keyword, option in _OPTIONS.items():
        text = text.replace(keyword, option)
    text = re.sub(r"\b(?P<name>[a-z]\w*)=(?P<quote>['\"])(?P<value>\w+)(?P=quote)", given, text)
    return re.sub(r"^([a-z]\w*): ", field, text)


def provenance(
    method: str,
    files: Sequence[Path],
    settings: Mapping[str, Any],
    columns: Path | None = None,
    *,
    command: str = "axisight identify",
) -> Provenance:
    """Return the provenance of what a command finds: hashes of logs and column map, and the given options."""
    files = [part for path in files for part in files_of(path)]
    files += [] if columns is None else [column_file(columns)]
    count = Counter(path.name for path in files)
    names = [path.name if count[path.name] == 1 else str(path) for path in files]
    return Provenance(
        f"{command} {method}",
        {name: hash_file(path) for name, path in zip(names, files, strict=True)},
        {name: value for name, value in settings.items() if value is not None},
    )


def write_robot(source: Robot, out: Path, found: Identified, *, force: bool) -> None:
    """Write robot and sidecar and print their paths; raise as `write_identified`."""
    try:
        sidecar = write_identified(source, out, found, overwrite=force)
    except OutputError as error:
        raise OutputError(f"--out: {error}") from None
    for path in (out, sidecar):
        say(f"written: {path}")


def pairs(option: str, given: Sequence[str] | None) -> dict[str, float]:
    """Return the numbers of NAME=VALUE texts by name; raise InputError naming the option."""
    out: dict[str, float] = {}
    for text in given or []:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise InputError(f"{option}: expected NAME=VALUE, got {text!r}")
        if name in out:
            raise InputError(f"{option}: expected {name} once, got it twice")
        (out[name],) = numbers(f"{option} {name}", value)
    return out


def band(option: str, text: str | None) -> tuple[float, float] | None:
    """Return the two numbers of LOW,HIGH, None for None; raise InputError naming the option."""
    if text is None:
        return None
    found = numbers(option, text)
    if len(found) != 2:
        raise InputError(f"{option}: expected two numbers LOW,HIGH, got {text!r}")
    return found[0], found[1]
