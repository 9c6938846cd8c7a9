"""Propose a column map for a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.columns import CsvOptions
from axisight.logs.guessing.angles import find_positions, settle_positions
from axisight.logs.guessing.clock import rate_of, take_time
from axisight.logs.guessing.derived import name_by_derivatives
from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.families import Family, families_of
from axisight.logs.guessing.incomplete import still_needed
from axisight.logs.guessing.measured import name_by_joints
from axisight.logs.guessing.named import Fit, named_map
from axisight.logs.guessing.names import called_after
from axisight.logs.guessing.others import (
    take_joint_positions,
    take_temperature,
    take_torque,
    take_velocity,
)
from axisight.logs.guessing.series import series_of
from axisight.logs.guessing.targets import take_targets
from axisight.logs.guessing.uneven import uneven_text
from axisight.logs.guessing.write import text_of
from axisight.logs.lazy import LazyArrays
from axisight.logs.map_files import AnyMap, named_map_text, parse_column_map
from axisight.logs.sources import load_arrays, suffix_of
from axisight.logs.sources_csv import header_line
from axisight.logs.stamps import are_dates, seconds_from_first
from axisight.robot import Robot

_NATIVE = ({"time_s", "position_1", "torque_cmd_1"}, {"time_s", "position_1", "position_ref_1"})
# Default reason for not using a signal, by the quantity in its name.
_REASONS = {
    "": "no word of its name is known",
    "other": "of the tool, computed, or a bound, by its name",
    "error": "a difference, by its name",
    "acceleration": "logs have no accelerations",
    "time": "another time",
}


@dataclass(frozen=True)
class Proposal:
    """A proposed column map: its TOML ``text``, and the same map parsed (``columns``).

    ``named`` is the name of the shipped map that fits the file, else None. If it is set, the proposal is that
    map, with `axes` if the robot has fewer than the file. ``doubts`` lists choices that may be wrong.
    ``unused`` gives the reason for every name that was left out. ``missing`` says what the user must add
    before the map can read a log; it is None if the map is complete.
    """

    text: str
    columns: AnyMap
    named: str | None
    doubts: tuple[str, ...]
    unused: dict[str, str]
    missing: str | None = None


def guess_columns(path: Path | str, robot: Robot | None = None) -> Proposal:
    """Return a proposed column map for the log at ``path``, from the names and numbers of its columns.

    Names give the quantity, the axis and, as a suffix or in brackets, the unit. Numbers give the units that
    names lack: the unit of time from its steps, units of angles and speeds from their derivatives or sizes.
    If no name says position, a column whose derivative correlates with another column is proposed as the
    position, unless a second column is equally likely. The proposal leaves out velocities that do not match
    the derivative and fields with several candidates, and says so in ``doubts``.

    ``robot`` gives the number, names and kinds of the axes. With it, columns named only as measured and by
    joint are proposed as positions.

    Raises LogError, listing the columns seen, when no time or no position is found and when there are fewer
    axes than the robot has. Raises LogError also for a file that needs no map, and as `read_log` for a file
    that cannot be read.
    """
    path = Path(path)
    opened, csv = _opened(path)
    found, unread = opened.readable()
    arrays = {name: _without_dates(values) for name, values in found.items()}
    if any(native <= set(arrays) for native in _NATIVE):
        return _native(path, LazyArrays.of(arrays))
    fit, against = named_map(arrays, robot, path)
    if fit is not None:
        return _named(path, fit)
    series, unused = series_of(arrays)
    unused |= unread
    joints = [] if robot is None else list(robot.axis_names)
    if not set(joints) <= set(called_after(joints, [one.name for one in series])):
        # Names of another arm: a name that both arms share could be of another axis.
        joints = []
    families = families_of(series, joints)
    draft = Draft(path, csv, list(arrays), families, robot, unused=unused, doubts=against)
    name_by_joints(draft)
    name_by_derivatives(draft, rate_of(arrays))
    family = find_positions(draft)
    take_time(draft, arrays)
    settle_positions(draft, family)
    for field in ("velocity", "velocity_ref"):
        take_velocity(draft, field)
    take_torque(draft)
    take_targets(draft)
    take_joint_positions(draft)
    take_temperature(draft)
    _leave_rest(draft)
    text = text_of(draft)
    columns = parse_column_map(text, f"{path}: guess")
    return Proposal(text, columns, None, tuple(draft.doubts), draft.unused, still_needed(draft))


def _native(path: Path, arrays: LazyArrays) -> Proposal:
    """Return the map of a file with native columns; raise LogError if uniform stamps make it unnecessary."""
    text = uneven_text(arrays, path)
    if text is None:
        raise LogError(
            f"{path}: expected a log without the native columns, got one: it needs no map"
        )
    return Proposal(text, parse_column_map(text, f"{path}: guess"), None, (), {})


def _named(path: Path, fit: Fit) -> Proposal:
    """Return a shipped map, with the number of axes of the robot if the file has more."""
    head = f"# The names of {path.name} are all those of this map, which ships as {fit.name}"
    if fit.axes is None:
        head += f":\n# --columns {fit.name} does without this file.\n#\n"
    else:
        head += f".\naxes = {fit.axes}  # those of the robot; the file has {fit.in_file}\n#\n"
    text = head + named_map_text(fit.name)
    doubts = () if fit.axes is None else (f"axes: the first {fit.axes} of {fit.in_file}",)
    return Proposal(text, parse_column_map(text, f"{path}: guess"), fit.name, doubts, {})


def _opened(path: Path) -> tuple[LazyArrays, CsvOptions]:
    """Return the arrays of a file and the CSV options found; the default options for other formats."""
    if suffix_of(path).removesuffix(".gz") not in {".csv", ".tsv"}:
        return load_arrays(path), CsvOptions()
    arrays = load_arrays(path, CsvOptions(separator="auto"))
    if len(header_line(path).split(",")) == len(arrays):
        return arrays, CsvOptions()
    numbers = [values.dtype.kind in "iuf" for values in arrays.readable()[0].values()]
    comma = CsvOptions(separator="auto", decimal=",")
    return (
        (arrays, CsvOptions(separator="auto"))
        if all(numbers)
        else (load_arrays(path, comma), comma)
    )


def _without_dates(values: NDArray[Any]) -> NDArray[Any]:
    """Return dates as seconds from the first; other values, and dates that are not all readable, as they are."""
    try:
        return seconds_from_first(values) if are_dates(values) else values
    except LogError:
        return values


def _leave_rest(draft: Draft) -> None:
    """Note a reason for every signal that is not used."""
    used = {id(one) for field in draft.fields for one in draft.signals(field)}
    used |= {id(one) for signals in draft.torques for one, _ in signals}
    for family in draft.families:
        if family.label not in draft.unused and not any(
            id(one) in used or one is draft.time or one.label in draft.unused
            for one in family.signals.values()
        ):
            draft.leave([family], _reason(family))


def _reason(family: Family) -> str:
    quantity = family.meaning.quantity
    if family.meaning.wanted:
        return f"a target of the {quantity}" if quantity else "a target, no name says of what"
    return _REASONS.get(quantity, f"another {quantity}")
