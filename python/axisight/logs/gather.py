"""Taking the signals a column map names out of the arrays of a file, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.columns import Address, ColumnMap, load_column_map
from axisight.logs.findings import Finding
from axisight.logs.joint_states import joint_state_map
from axisight.logs.log import Floats
from axisight.logs.native import native_map
from axisight.logs.sources import Arrays, load_arrays
from axisight.logs.sources_bag import is_bag
from axisight.logs.units import si_factor, si_offset

if TYPE_CHECKING:
    from axisight.robot import Robot

Channel = tuple[str, int]
"""Field of an axis (`position`, `torque`, ...) and 0-based axis."""


@dataclass
class Gathered:
    """The signals found in SI units, each 1-D, and what was wrong with the others."""

    path: Path
    columns: ColumnMap
    signals: dict[Channel, Floats] = field(default_factory=dict)
    labels: dict[Channel, str] = field(default_factory=dict)
    time_s: Floats | None = None
    rate_hz: float | None = None
    findings: list[Finding] = field(default_factory=list)
    unused: tuple[str, ...] = ()


def gather(
    path: Path | str,
    columns: ColumnMap | Path | str | None = None,
    robot: Robot | None = None,
) -> Gathered:
    """Open a log and take out every mapped signal; problems of single columns become findings.

    ``robot``: whose log it is; without one signals of joints stay as they are. Raises LogError when the file or
    the map itself cannot be used.
    """
    path = Path(path)
    given = columns if columns is None or isinstance(columns, ColumnMap) else None
    if columns is not None and given is None:
        assert not isinstance(columns, ColumnMap)
        given = load_column_map(columns)
    files = _Files(path, given)
    result = Gathered(path, _usual_map(files.main, robot, path) if given is None else given)
    _take_time(files, result)
    for number, axis in enumerate(result.columns.axis):
        for name in type(axis).model_fields:
            signal = getattr(axis, name)
            if signal is not None:
                _take_signal(files, result, (name, number), signal)
    if result.columns.side == "joint" and robot is not None:
        _to_motors(result, robot)
    used = {label.split("[")[0] for label in result.labels.values()}
    if given is None:
        result.unused = tuple(sorted(set(files.main) - used - {"time_s"}))
    return result


def _usual_map(arrays: Arrays, robot: Robot | None, path: Path) -> ColumnMap:
    """Return the map of a file that comes without one: of a recording of ROS, or of native columns."""
    return joint_state_map(arrays, robot, path) if is_bag(path) else native_map(arrays, str(path))


# How a motor's signal follows from the joint's, by the power of the gear ratio r (joint per motor angle).
_POWERS = {"position": -1, "velocity": -1, "velocity_ref": -1, "position_ref": -1, "torque": 1}


def _to_motors(result: Gathered, robot: Robot) -> None:
    """Turn signals of joints into those of their motors."""
    for (name, axis), values in result.signals.items():
        if name in _POWERS and axis < robot.n_axes:
            result.signals[name, axis] = values * robot.gear_ratio[axis] ** _POWERS[name]


class _Files:
    """The log's own arrays and those of sibling files, each file opened once."""

    def __init__(self, path: Path, columns: ColumnMap | None) -> None:
        self._folder = path.parent
        self._csv = columns.csv if columns is not None else None
        self._opened: dict[str, Arrays] = {}
        self.main = load_arrays(path, self._csv)

    def of(self, address: Address) -> Arrays:
        if address.file is None:
            return self.main
        if address.file not in self._opened:
            self._opened[address.file] = load_arrays(self._folder / address.file, self._csv)
        return self._opened[address.file]


def _take_time(files: _Files, result: Gathered) -> None:
    columns = result.columns
    try:
        if columns.time is not None:
            values = _vector(files.of(columns.time), columns.time)
            result.time_s = values * si_factor(columns.time.unit)
    except LogError as error:
        result.findings.append(
            Finding("error", columns.time.label if columns.time else "", str(error))
        )
    rate = columns.sample_rate_hz
    if rate is None:
        return
    try:
        result.rate_hz = _scalar(files.main, rate)
        if result.rate_hz <= 0:
            result.rate_hz = None
            raise LogError(f"expected a positive rate in Hz, got {rate!r}")
    except LogError as error:
        result.findings.append(Finding("error", "sample_rate_hz", str(error)))


def _take_signal(files: _Files, result: Gathered, channel: Channel, signal: Any) -> None:
    result.labels[channel] = signal.label
    try:
        arrays = files.of(signal)
        values = _vector(arrays, signal)
        scale = 1.0 if signal.scale is None else _scalar(arrays, signal.scale)
    except LogError as error:
        result.findings.append(Finding("error", signal.label, str(error)))
        return
    factor = signal.sign * scale * si_factor(signal.unit, signal.counts_per_rev)
    result.signals[channel] = values * factor + si_offset(signal.unit)


def _vector(arrays: Mapping[str, NDArray[Any]], address: Address) -> Floats:
    """Return the addressed values as 1-D float64; raise LogError saying expected and got."""
    if address.name not in arrays:
        listed = ", ".join(list(arrays)[:12]) or "nothing"
        raise LogError(f"expected a column named {address.name!r}, got {listed}")
    values: Any = arrays[address.name]
    if address.index is not None:
        key = tuple(
            slice(None) if part.strip() == ":" else int(part)
            for part in str(address.index).split(",")
        )
        try:
            values = values[key]
        except IndexError:
            raise LogError(
                f"expected an index inside shape {values.shape}, got [{address.index}]"
            ) from None
    vector = np.squeeze(np.asarray(values))
    if vector.ndim != 1:
        raise LogError(
            f"expected one value per sample, got shape {vector.shape}; pick a row or column with "
            'index, for example ":,0"'
        )
    return _numbers(vector)


def _numbers(vector: NDArray[Any]) -> Floats:
    if vector.dtype.kind in "biuf":
        return vector.astype(np.float64)
    if vector.dtype.kind == "c":
        raise LogError("expected real numbers, got complex ones")
    if vector.dtype.kind in "mM":
        raise LogError(f"expected numbers, got dates of type {vector.dtype}")
    numbers = np.empty(vector.size)
    for index, value in enumerate(vector):
        try:
            numbers[index] = np.nan if value is None else float(value)
        except (TypeError, ValueError):
            raise LogError(f"expected numbers, got {value!r} at index {index}") from None
    return numbers


def _scalar(arrays: Mapping[str, NDArray[Any]], value: float | str) -> float:
    """Return the number itself, or the scalar of that name in the file."""
    if not isinstance(value, str):
        return value
    found = arrays.get(value)
    if found is None:
        raise LogError(f"expected a scalar named {value!r} in the file, got none")
    if found.size != 1 or found.dtype.kind not in "biuf" or not np.isfinite(found).all():
        raise LogError(f"expected {value!r} to be one finite number, got shape {found.shape}")
    return float(found.reshape(-1)[0])
