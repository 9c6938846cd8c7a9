"""What the commands ``axisight identify`` share: writing the robot, options with names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from axisight.cli.common import numbers, say
from axisight.cli.panels import ADVANCED
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


def load_source(robot: str) -> Robot:
    """Return a preset or the robot of a file, with the effects that an earlier command found.

    Raises InputError as `refuse_effects_beside`.
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
) -> list[Log]:
    """Return what is ``used`` of logs that pass what ``axisight check`` looks at; warnings are printed.

    Identification fits data in wrong units, or with rows missing, as well as any. Raises InputError
    for an error that the check finds, and for what :func:`check_fit_inputs` refuses by name, unless
    ``unchecked``, and for an axis that turns where that of the robot slides.
    """
    logs = []
    said: set[tuple[str, str]] = set()
    for path in paths:
        said |= _checked(path, columns, unchecked=unchecked)
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


def _checked(path: Path, columns: Path | None, *, unchecked: bool) -> set[tuple[str, str]]:
    """Print what ``axisight check`` warns of, and return it as (name of the log, message).

    Raises InputError for its errors, unless ``unchecked``, but for those that have a name: these are
    refused by reading, or where they lie in the part that is used.
    """
    said = set()
    for finding in check_log(path, columns).findings:
        text = f"{path.name}: {finding.column}: {finding.message}"
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
    """Raise OutputError before any work for a robot that cannot be written with its sidecar.

    Logs and their column map are never replaced, the robot with ``force``: it grows from step to step.
    """
    if out is None:
        return
    targets = {"--out": out, "--out, sidecar": sidecar_path(out)}
    inputs = [*logs, *(x for x in (columns,) if x)]
    check_targets(targets, inputs=inputs, replaces=dict.fromkeys(targets, ()), force=force)


def options(ctx: typer.Context) -> dict[str, Any]:
    """Return the options of a command that say how it worked: numbers, choices, names of files."""
    out: dict[str, Any] = {}
    for name, value in ctx.params.items():
        if isinstance(value, list | tuple):
            out[name] = [v.name if isinstance(v, Path) else v for v in value]
        elif name not in ("robot", "out", "force"):
            out[name] = value.name if isinstance(value, Path) else value
    return out


@contextmanager
def as_options(ctx: typer.Context) -> Iterator[None]:
    """Say errors of the library in the words of the shell: options instead of keyword arguments."""
    try:
        yield
    except AxisightError as error:
        raise InputError(option_words(str(error), option_names(ctx))) from None


# Keyword arguments whose option has another name.
_OPTIONS = {'deficient="group"': "--group", "`known`": "--known"}


def option_names(ctx: typer.Context) -> list[str]:
    """Return the names of a command's options, as its function has them; arguments have no dashes."""
    return [p.name for p in ctx.command.params if p.name and p.param_type_name == "option"]


def option_words(text: str, options: Collection[str]) -> str:
    """Return a message with ``cutoff_hz`` as ``--cutoff-hz``, and ``method="wls"`` as ``--method wls``.

    ``options``: names of the options of the command.
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
    method: str, files: Sequence[Path], settings: Mapping[str, Any], columns: Path | None = None
) -> Provenance:
    """Return where values come from: hashes of files, the column map too, and the options given."""
    files = [part for path in files for part in files_of(path)]
    files += [] if columns is None else [column_file(columns)]
    count = Counter(path.name for path in files)
    names = [path.name if count[path.name] == 1 else str(path) for path in files]
    return Provenance(
        f"axisight identify {method}",
        {name: hash_file(path) for name, path in zip(names, files, strict=True)},
        {name: value for name, value in settings.items() if value is not None},
    )


def write_robot(source: Robot, out: Path, found: Identified, *, force: bool) -> None:
    """Write robot and sidecar and say so; raises InputError if they cannot be written."""
    try:
        sidecar = write_identified(source, out, found, overwrite=force)
    except OutputError as error:
        raise OutputError(f"--out: {error}") from None
    for path in (out, sidecar):
        say(f"written: {path}")


def pairs(option: str, given: Sequence[str] | None) -> dict[str, float]:
    """Return the numbers in NAME=VALUE texts; raises InputError naming the option."""
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
    """Return two numbers; raises InputError naming the option."""
    if text is None:
        return None
    found = numbers(option, text)
    if len(found) != 2:
        raise InputError(f"{option}: expected two numbers LOW,HIGH, got {text!r}")
    return found[0], found[1]
