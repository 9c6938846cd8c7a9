"""Collect the signals that a column map names from the arrays of a file, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import did_you_mean, short, shown, usable_path
from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.columns import UNKNOWN, Address, AxisColumns, ColumnMap, TimeColumn
from axisight.logs.findings import Finding
from axisight.logs.joint_states import joint_state_map
from axisight.logs.lazy import LazyArrays
from axisight.logs.log import Floats
from axisight.logs.map_files import AnyMap, load_column_map
from axisight.logs.mean_rate import mean_rate_hz
from axisight.logs.native import native_map
from axisight.logs.patterns import ColumnPattern
from axisight.logs.sources import load_arrays
from axisight.logs.sources_bag import is_bag
from axisight.logs.sources_lerobot import is_lerobot
from axisight.logs.stamps import EXAMPLE, are_dates, seconds_from_first
from axisight.logs.units import si_factor, si_offset

if TYPE_CHECKING:
    from axisight.robot import Robot

_FIELDS = tuple(AxisColumns.model_fields)
# Checking the time stamps takes this many arrays of their length.
_TIME_COST = 4
# No limit in effect: arrays in memory cost nothing more to read.
_ENOUGH = 2**62
Channel = tuple[str, int]
"""Field of an axis (`position`, `torque`, ...) and 0-based axis."""
Reading = tuple[str, str]
"""Name of an accelerometer and direction (`x`, `y` or `z`)."""


@dataclass
class Gathered:
    """The signals found, in SI units and 1-D, and findings about the others.

    `accelerations` are the readings of accelerometers (m/s^2), `reading_labels` their columns. `doubts` concern
    whole files. A grid of more than `most_samples` would exceed the budget. `mapped`: the caller gave a column
    map. `currents`: axes (from 0) whose torque was logged as a motor current; without a robot it stays in A.
    `unknown`: those of these axes whose torque constant is unknown, with the constant of the robot that converted
    them (Nm/A), or NaN if they are still in A.
    """

    path: Path
    columns: ColumnMap
    signals: dict[Channel, Floats] = field(default_factory=dict)
    labels: dict[Channel, str] = field(default_factory=dict)
    accelerations: dict[Reading, Floats] = field(default_factory=dict)
    reading_labels: dict[Reading, str] = field(default_factory=dict)
    time_s: Floats | None = None
    rate_hz: float | None = None
    findings: list[Finding] = field(default_factory=list)
    unused: tuple[str, ...] = ()
    pattern: ColumnPattern | None = None
    doubts: tuple[str, ...] = ()
    most_samples: int = 2**62
    mapped: bool = False
    currents: set[int] = field(default_factory=set)
    unknown: dict[int, float] = field(default_factory=dict)

    @property
    def notes(self) -> list[str]:
        """The notes of the map on its signals, without repetition."""
        addresses = _addresses(self.columns)
        return list(dict.fromkeys(a.note for a in addresses if a.note is not None))

    @property
    def all_signals(self) -> dict[str, Floats]:
        """All signals by the label of their columns: those of axes first, then those of accelerometers."""
        of_axes = {self.labels[channel]: values for channel, values in self.signals.items()}
        return of_axes | {
            self.reading_labels[place]: values for place, values in self.accelerations.items()
        }


def gather(
    path: Path | str,
    columns: AnyMap | Path | str | None = None,
    robot: Robot | None = None,
    max_bytes: int | None = None,
) -> Gathered:
    """Open a log and return every mapped signal; problems with single columns become findings.

    ``robot``: the robot of the log; without it, joint-side signals are not converted. ``max_bytes``: limit on
    the bytes that all mapped columns may declare. Raises LogError when the file or the map itself cannot be
    used.
    """
    path = usable_path(path, LogError)
    given = load_column_map(columns) if isinstance(columns, Path | str) else columns
    files = _Files(path, given, Budget(max_bytes))
    return _gathered(files, path, given, robot)


def gather_arrays(
    arrays: Mapping[str, NDArray[Any]], name: str, columns: AnyMap, robot: Robot | None = None
) -> Gathered:
    """Return every mapped signal of arrays in memory; messages call the arrays ``name``.

    Problems with single columns become findings, as in `gather`.
    """
    path = Path(name)
    files = _Files(path, columns, Budget(_ENOUGH), LazyArrays.of(arrays))
    return _gathered(files, path, columns, robot)


def _gathered(files: _Files, path: Path, given: AnyMap | None, robot: Robot | None) -> Gathered:
    budget = files.budget
    chosen = _usual_map(files.main, robot, path) if given is None else given
    pattern = chosen if isinstance(chosen, ColumnPattern) else None
    if isinstance(chosen, ColumnPattern):
        chosen = chosen.for_file(files.main, robot, path)
    result = Gathered(path, chosen, pattern=pattern, mapped=given is not None)
    _take_time(files, result)
    for number, axis in enumerate(result.columns.axis):
        for name in _FIELDS:
            signal = getattr(axis, name)
            if signal is not None:
                result.labels[name, number] = signal.label
                values = _signal(files, result, signal)
                if values is not None:
                    result.signals[name, number] = values
    _take_accelerations(files, result)
    empty = _leave_empty_torques(result)
    _to_torques(result, robot)
    if result.time_s is None:
        _count_time(result, budget)
    if result.columns.side == "joint" and robot is not None:
        _to_motors(result, robot)
    if given is None:
        result.unused = tuple(sorted(set(files.main) - _used_names(result.columns)))
    result.doubts = (*files.doubts(), *empty)
    result.findings += [Finding("warning", "file", doubt) for doubt in result.doubts]
    result.most_samples = budget.limit // (
        8 * (len(result.signals) + len(result.accelerations) + 1)
    )
    return result


def _leave_empty_torques(result: Gathered) -> tuple[str, ...]:
    """Take torques that are zero or NaN throughout off a log with targets of its positions; return the doubt.

    Some drivers publish an effort field that nobody fills.
    """
    axes = range(len(result.columns.axis))
    torques = [result.signals.get(("torque", axis)) for axis in axes]
    if any(("position_ref", axis) not in result.signals for axis in axes) or any(
        x is None or x.size == 0 or np.nan_to_num(x).any() for x in torques
    ):
        return ()
    # Zeros beside references of speed may be a dead channel of a log that has torques; NaN is no channel.
    speeds = any(field == "velocity_ref" for field, _ in result.signals)
    if speeds and not all(x is not None and np.isnan(x).all() for x in torques):
        return ()
    for axis in axes:
        del result.signals["torque", axis]
    bare = [axis.model_copy(update={"torque": None}) for axis in result.columns.axis]
    result.columns = result.columns.model_copy(update={"axis": bare})
    return ("torques that are zero or NaN throughout count as not logged",)


def _count_time(result: Gathered, budget: Budget) -> None:
    """Count the time stamps that a log without stamps gets from its rate."""
    longest = max((values.nbytes for values in result.signals.values()), default=0)
    try:
        budget.take(2 * longest)
    except LogError as error:
        result.findings.append(Finding("error", "sample_rate_hz", str(error)))


def _used_names(columns: ColumnMap) -> set[str]:
    return {address.name for address in _addresses(columns)}


def _addresses(columns: ColumnMap) -> list[Address]:
    """Return the places of the time and of all signals."""
    signals = [getattr(axis, name) for axis in columns.axis for name in _FIELDS]
    readings = [a for sensor in columns.accelerometer for a in sensor.readings.values()]
    return [a for a in (columns.time, *signals, *readings) if a is not None]


def _usual_map(arrays: LazyArrays, robot: Robot | None, path: Path) -> AnyMap:
    """Return the map of a file that needs none from the caller: ROS, LeRobot or native columns."""
    if is_lerobot(path):
        return load_column_map("lerobot")
    if is_bag(path):
        return joint_state_map(arrays, robot, path, arrays.doubts)
    return native_map(arrays, str(path))


# Motor-side signal = joint-side signal * r ** power, with the gear ratio r = joint angle / motor angle.
_POWERS = {"position": -1, "velocity": -1, "velocity_ref": -1, "position_ref": -1, "torque": 1}


def _to_torques(result: Gathered, robot: Robot | None) -> None:
    """Convert motor currents to torques with the torque constants of the robot."""
    for number, columns in enumerate(result.columns.axis):
        signal = columns.torque
        if signal is None or not signal.is_current:
            continue
        result.currents.add(number)
        there = robot is not None and number < robot.n_axes
        constant = robot.torque_constants[number] if robot is not None and there else None
        if signal.is_unknown:
            result.unknown[number] = np.nan if constant is None else constant
        if robot is None or not there:  # the caller reports a missing robot if it needs one
            continue
        if constant is None and signal.is_unknown:
            continue
        if constant is None:
            joint = robot.axis_names[number]
            result.findings.append(Finding("error", signal.label, _no_constant(joint)))
        elif ("torque", number) in result.signals:
            result.signals["torque", number] *= constant


def _no_constant(joint: str) -> str:
    return (
        f"expected scale (Nm or N per A) with unit 'A', or joint.{joint}.torque_constant in the drive data of a "
        f'model file, got neither; with scale = "{UNKNOWN}" a diagnosis finds the constant'
    )


def _to_motors(result: Gathered, robot: Robot) -> None:
    """Convert joint-side signals to the motor side; currents are motor-side already."""
    for name, axis in result.signals:
        if name == "torque" and axis in result.currents:
            continue
        if name in _POWERS and axis < robot.n_axes:
            result.signals[name, axis] *= robot.gear_ratio[axis] ** _POWERS[name]


class _Files:
    """The log's own arrays and those of sibling files, each file opened once."""

    def __init__(
        self, path: Path, columns: AnyMap | None, budget: Budget, main: LazyArrays | None = None
    ) -> None:
        self._folder = path.parent
        self._csv = columns.csv if columns is not None else None
        self.budget = budget
        self._opened: dict[str, LazyArrays] = {}
        self.main = load_arrays(path, self._csv, budget) if main is None else main

    def of(self, address: Address) -> LazyArrays:
        if address.file is None:
            return self.main
        if address.file not in self._opened:
            path = self._folder / usable_path(address.file, LogError)
            self._opened[address.file] = load_arrays(path, self._csv, self.budget)
        return self._opened[address.file]

    def doubts(self) -> tuple[str, ...]:
        """Return the doubts about all files, prefixed by the file name except for the log itself."""
        siblings = [
            f"{short(name)}: {d}" for name, file in self._opened.items() for d in file.doubts
        ]
        return (*self.main.doubts, *siblings)


def _take_time(files: _Files, result: Gathered) -> None:
    columns = result.columns
    try:
        if columns.time is not None:
            values = _stamps(
                _vector(files.of(columns.time), columns.time, files.budget), columns.time
            )
            files.budget.take(_TIME_COST * values.nbytes)
            with np.errstate(over="ignore"):
                result.time_s = values * si_factor(columns.time.unit)
    except LogError as error:
        result.findings.append(
            Finding("error", columns.time.label if columns.time else "", str(error))
        )
    if columns.time is not None and columns.time.resample_hz == "mean":
        where = f"{result.path}: {columns.time.label}"
        mean = None if result.time_s is None else mean_rate_hz(result.time_s, where)
        time = columns.time.model_copy(update={"resample_hz": mean})
        result.columns = columns.model_copy(update={"time": time})
    rate = columns.sample_rate_hz
    if rate is None:
        return
    try:
        result.rate_hz = _scalar(files.main, rate)
        if result.rate_hz <= 0:
            result.rate_hz = None
            raise LogError(f"expected a positive rate in Hz, got {shown(rate)}")
    except LogError as error:
        result.findings.append(Finding("error", "sample_rate_hz", str(error)))


def _take_accelerations(files: _Files, result: Gathered) -> None:
    for sensor in result.columns.accelerometer:
        for direction, signal in sensor.readings.items():
            result.reading_labels[sensor.name, direction] = signal.label
            values = _signal(files, result, signal)
            if values is not None:
                result.accelerations[sensor.name, direction] = values


def _signal(files: _Files, result: Gathered, signal: Any) -> Floats | None:
    """Return a signal in SI units; None, with a finding, if it cannot be read."""
    try:
        arrays = files.of(signal)
        values = _numbers(_vector(arrays, signal, files.budget))
        scale, offset = (_scalar(arrays, value) for value in signal.line)
    except LogError as error:
        result.findings.append(Finding("error", signal.label, str(error)))
        return None
    factor = signal.sign * scale * si_factor(signal.unit, signal.counts_per_rev)
    # In place: the log may have used all of its budget already.
    with np.errstate(over="ignore", invalid="ignore"):  # check_finite reports values that overflow
        values -= offset
        values *= factor
        values += si_offset(signal.unit)
    return values


def _vector(arrays: Mapping[str, NDArray[Any]], address: Address, budget: Budget) -> NDArray[Any]:
    """Return the addressed values (n,), counted as float64; raise LogError if they are missing."""
    if address.name not in arrays:
        listed = ", ".join(map(short, list(arrays)[:12])) or "nothing"
        meant = did_you_mean(address.name, arrays)
        raise LogError(f"expected a column named {shown(address.name)}, got {listed}{meant}")
    values: Any = arrays[address.name]
    if address.index is not None:
        try:
            key = tuple(
                slice(None) if part.strip() == ":" else int(part)
                for part in str(address.index).split(",")
            )
            values = values[key]
        except (IndexError, ValueError, OverflowError):
            raise LogError(
                f"expected an index inside shape {values.shape}, got [{short(str(address.index))}]"
            ) from None
    vector = np.squeeze(np.asarray(values))
    if vector.ndim != 1:
        raise LogError(
            f"expected one value per sample, got shape {vector.shape}; pick a row or column with "
            'index, for example ":,0"'
        )
    budget.take(8 * vector.size)
    return vector


def _stamps(vector: NDArray[Any], time: TimeColumn) -> Floats:
    """Return time stamps (n,) as numbers: in their unit, or of dates in seconds from the first."""
    if not are_dates(vector):
        return _numbers(vector, f"numbers or ISO 8601 stamps such as {EXAMPLE}")
    if time.unit != "s":
        raise LogError(f"unit: expected s, or none, with dates, got {time.unit}")
    return seconds_from_first(vector)


def _numbers(vector: NDArray[Any], wanted: str = "numbers") -> Floats:
    """Return values (n,) as float64; raise LogError, saying what was ``wanted``, for anything but real numbers."""
    if vector.dtype.kind in "biuf":
        # Damaged bytes may decode to signaling NaN, on which NumPy warns; check_finite reports them.
        with np.errstate(invalid="ignore"):
            return vector.astype(np.float64)
    if vector.dtype.kind == "c":
        raise LogError("expected real numbers, got complex ones")
    if vector.dtype.kind in "mM":
        raise LogError(f"expected numbers, got dates of type {vector.dtype}")
    numbers = np.empty(vector.size)
    for index, value in enumerate(vector):
        try:
            numbers[index] = np.nan if value is None else float(value)
        except (TypeError, ValueError, OverflowError):
            raise LogError(f"expected {wanted}, got {shown(value)} at index {index}") from None
    return numbers


def _scalar(arrays: Mapping[str, NDArray[Any]], value: float | str) -> float:
    """Return a number as it is, or the scalar in the file that a text names."""
    if not isinstance(value, str):
        return value
    found = arrays.get(value)
    if found is None:
        raise LogError(f"expected a scalar named {shown(value)} in the file, got none")
    if found.size != 1 or found.dtype.kind not in "biuf" or not np.isfinite(found).all():
        raise LogError(f"expected {shown(value)} to be one finite number, got shape {found.shape}")
    return float(found.reshape(-1)[0])
