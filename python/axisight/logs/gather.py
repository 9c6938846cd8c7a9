"""Taking the signals a column map names out of the arrays of a file, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.columns import Address, ColumnMap, load_column_map
from axisight.logs.findings import Finding
from axisight.logs.log import Floats
from axisight.logs.native import native_map
from axisight.logs.sources import Arrays, load_arrays
from axisight.logs.units import si_factor, si_offset

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


def gather(path: Path | str, columns: ColumnMap | Path | str | None = None) -> Gathered:
    """Open a log and take out every mapped signal; problems of single columns become findings.

    Raises LogError when the file or the map itself cannot be used.
    """
    path = Path(path)
    given = columns if columns is None or isinstance(columns, ColumnMap) else None
    if columns is not None and given is None:
        assert not isinstance(columns, ColumnMap)
        given = load_column_map(columns)
    files = _Files(path, given)
    result = Gathered(path, given if given is not None else native_map(files.main, str(path)))
    _take_time(files, result)
    for number, axis in enumerate(result.columns.axis):
        for name in type(axis).model_fields:
            signal = getattr(axis, name)
            if signal is not None:
                _take_signal(files, result, (name, number), signal)
    used = {label.split("[")[0] for label in result.labels.values()}
    if given is None:
        result.unused = tuple(sorted(set(files.main) - used - {"time_s"}))
    return result


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
