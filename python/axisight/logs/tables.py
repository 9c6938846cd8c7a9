"""Logs out of tables in memory: pandas DataFrames, xarray Datasets, mappings of arrays."""

from __future__ import annotations

import dataclasses
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import nearest, short
from axisight.errors import LogError
from axisight.logs.columns import ColumnMap
from axisight.logs.gather import gather_arrays
from axisight.logs.log import Log
from axisight.logs.map_files import AnyMap, load_column_map
from axisight.logs.reading import log_of
from axisight.robot.axis_names import axis_number

if TYPE_CHECKING:
    from axisight.robot import Robot

# Name of a signal -> field of an axis in a column map.
_FIELDS = {
    "torque_cmd": "torque",
    "torque": "torque",
    "position_ref": "position_ref",
    "position": "position",
    "velocity_ref": "velocity_ref",
    "velocity": "velocity",
    "joint_position": "joint_position",
    "temperature": "temperature",
}
# Unit in a name or attribute -> unit of a column map, by the last word of the field.
_POSITION = {"rad": "rad", "deg": "deg", "rev": "rev", "mm": "mm", "m": "m"}
_VELOCITY = {
    **{"rad_s": "rad/s", "deg_s": "deg/s", "rev_s": "rev/s", "rpm": "rpm"},
    **{"mm_s": "mm/s", "m_s": "m/s"},
}
_TORQUE = {"nm": "Nm", "n": "N", "a": "A"}
_TEMPERATURE = {"degc": "degC", "c": "degC", "k": "K"}
_UNITS = {
    "position": _POSITION,
    "position_ref": _POSITION,
    "joint_position": _POSITION,
    "velocity": _VELOCITY,
    "velocity_ref": _VELOCITY,
    "torque": _TORQUE,
    "temperature": _TEMPERATURE,
}
# What a name without a unit means on an axis that turns, and on one that slides.
_SLIDING = {"rad": "m", "rad/s": "m/s", "Nm": "N", "degC": "degC"}
_TIMES = re.compile(r"(?:time|t|timestamp)(?:_(s|ms|us|ns))?", re.IGNORECASE)
# Names that a message lists.
_SHOWN = 12


@dataclass(frozen=True)
class _Column:
    """A named array (n,) or (n, axes), the unit that stands beside it, and what its second axis is labelled."""

    name: str
    values: NDArray[Any]
    units: str = ""
    axes: tuple[Any, ...] | None = None


@dataclass
class _Found:
    """Columns of a table by field and axis (from 0), with units; the time column; names of no meaning."""

    signals: dict[tuple[str, int], tuple[str, str]]
    arrays: dict[str, NDArray[Any]]
    time: tuple[str, str] | None
    others: list[str]


def is_table(value: object) -> bool:
    """Whether a value is a table in memory: a DataFrame, a Dataset, a mapping, or what turns into a DataFrame."""
    return isinstance(value, xr.Dataset | Mapping) or _is_frame(value) or _converts(value)


def log_of_table(
    table: object,
    columns: AnyMap | Path | str | None = None,
    *,
    name: str = "log",
    robot: Robot | None = None,
    currents: bool = False,
) -> Log:
    """Return the log of a table in memory.

    Parameters
    ----------
    table : a pandas DataFrame, an xarray Dataset, a mapping of names to arrays, or an object with
        `to_pandas` (polars, pyarrow). Signals are (n,) each, or (n, axes) in a Dataset or mapping.
    columns : a column map or its path, as in `read_log`. Without one, signals are found by name:
        `position_1`, `torque_cmd_1` (or `torque_1`), `position_ref_1`, `velocity_ref_1`,
        `velocity_1`, `joint_position_1`, `temperature_1`, and `time_s` (or the index). The number
        may be a joint name of the robot, and is left out where an array has all axes. A unit may
        follow: `position_deg_1`, `velocity_rpm_1`, `torque_nm_1`, `time_ms`. The attribute `units`
        of a Dataset counts first; without any unit, signals are in rad, rad/s, Nm, degC and s.
    name : what the log is called.
    robot, currents : as in `read_log`.

    Raises LogError naming the column, what was expected and what came, with the nearest name.

    """
    listed = _columns(table, name)
    if columns is not None:
        given = load_column_map(columns) if isinstance(columns, Path | str) else columns
        arrays = {column.name: column.values for column in listed}
    else:
        found = _found(listed, name, robot)
        given, arrays = _map_of(found, name, table, robot), found.arrays
    log = log_of(gather_arrays(arrays, name, given, robot), robot=robot, currents=currents)
    attrs = getattr(table, "attrs", {})
    kept = {key: attrs[key] for key in ("excitation", "period_s") if key in attrs}
    return dataclasses.replace(log, name=name, source=Path(name), **kept)


def _is_frame(value: object) -> bool:
    pandas = sys.modules.get("pandas")  # without it nobody has a DataFrame
    return pandas is not None and isinstance(value, pandas.DataFrame)


def _converts(value: object) -> bool:
    return hasattr(value, "to_pandas") and not isinstance(value, xr.DataArray)


def _columns(table: object, name: str) -> list[_Column]:
    """Return the arrays of a table by name; raises LogError for a name that stands twice."""
    if isinstance(table, xr.Dataset):
        found = list(_of_dataset(table))
    elif isinstance(table, Mapping):
        found = [_Column(str(key), np.asarray(values)) for key, values in table.items()]
    else:
        frame = table if _is_frame(table) else cast(Any, table).to_pandas()
        found = list(_of_frame(frame))
    names = [column.name for column in found]
    twice = next((one for one in names if names.count(one) > 1), None)
    if twice is not None:
        raise LogError(f"{name}: {short(twice)}: expected one column of that name, got several")
    return found


def _of_frame(frame: Any) -> Iterator[_Column]:
    index, names = frame.index, [_flat(name) for name in frame.columns]
    if index.dtype.kind in "mM":
        yield _Column("time_s", np.asarray((index - index[0]) / np.timedelta64(1, "s"), float))
    elif index.name is not None and str(index.name) not in names:
        yield _Column(str(index.name), np.asarray(index))
    for k, name in enumerate(names):
        yield _Column(name, np.asarray(frame.iloc[:, k].to_numpy()))


def _flat(name: object) -> str:
    """Return the name of a column; levels of a MultiIndex are joined: `("position", 1)` is `position_1`."""
    return "_".join(map(str, name)) if isinstance(name, tuple) else str(name)


def _of_dataset(table: xr.Dataset) -> Iterator[_Column]:
    times = [str(key) for key in table.variables if _TIMES.fullmatch(str(key))]
    along = {dim for key in times for dim in table[key].dims}
    for key, array in table.variables.items():
        values, units = array.values, str(array.attrs.get("units", ""))
        if array.ndim == 2 and set(array.dims) & along:
            time, other = sorted(array.dims, key=lambda dim: dim not in along)
            labels = table[other].values.tolist() if other in table.coords else None
            values = array.transpose(time, other).values
            yield _Column(str(key), values, units, None if labels is None else tuple(labels))
        elif array.ndim in {1, 2}:
            yield _Column(str(key), values, units)


def _found(columns: Sequence[_Column], name: str, robot: Robot | None) -> _Found:
    """Return what the names of columns mean; raises LogError for two columns of one meaning."""
    joints = [] if robot is None else robot.axis_names
    found = _Found({}, {}, None, [])
    pattern = _pattern(joints)
    for column in columns:
        time = _TIMES.fullmatch(column.name)
        if time and column.values.ndim == 1:
            unit = column.units if column.units in {"s", "ms", "us", "ns"} else time[1] or "s"
            found.time = (column.name, unit.lower())
            found.arrays[column.name] = column.values
            continue
        match = pattern.fullmatch(column.name)
        if match is None:
            found.others.append(column.name)
            continue
        field = _FIELDS[match["stem"].lower()]
        for k, entry, values in _by_axis(column, match["axis"], joints):
            unit = _unit(column, match["before"] or match["behind"], field, k, robot)
            if (field, k) in found.signals:
                first = found.signals[field, k][0]
                raise LogError(
                    f"{name}: {field} of axis {k + 1}: expected one column, got {first} and {entry}; "
                    "a column map (columns=...) says which one is meant"
                )
            found.signals[field, k] = (entry, unit)
            found.arrays[entry] = values
    return found


def _pattern(joints: Sequence[str]) -> re.Pattern[str]:
    """Return the pattern of names: signal, unit, axis, with the unit before or behind the axis."""
    stems = "|".join(_FIELDS)
    words = sorted({unit for units in _UNITS.values() for unit in units}, key=len, reverse=True)
    units = "|".join(words)
    axes = "|".join([r"[1-9]\d{0,3}", *(re.escape(joint) for joint in joints)])
    return re.compile(
        rf"(?P<stem>{stems})(?:_(?P<before>{units}))?(?:_(?P<axis>{axes}))?(?:_(?P<behind>{units}))?",
        re.IGNORECASE,
    )


def _by_axis(
    column: _Column, place: str | None, joints: Sequence[str]
) -> Iterator[tuple[int, str, NDArray[Any]]]:
    """Yield axis (from 0), name and values of each signal in a column."""
    if column.values.ndim < 2:
        axis = (
            1 if place is None else int(place) if place.isdecimal() else axis_number(place, joints)
        )
        yield axis - 1, column.name, column.values
        return
    n = column.values.shape[1]
    labels = column.axes or tuple(range(1, n + 1))
    if joints and all(isinstance(label, str) for label in labels):
        if not set(labels) <= set(joints):  # of all joints, elastic ones too
            return
        numbers = [axis_number(label, joints) for label in labels]
    elif sorted(map(str, labels)) == sorted(map(str, range(1, n + 1))):
        numbers = [int(label) for label in labels]
    else:
        numbers = list(range(1, n + 1))
    for k, number in enumerate(numbers):
        yield number - 1, f"{column.name}[{k}]", column.values[:, k]


def _unit(column: _Column, suffix: str | None, field: str, axis: int, robot: Robot | None) -> str:
    """Return the unit of a signal: as an attribute says, its name, or the usual one."""
    units = _UNITS[field]
    said = column.units.split(", ")
    beside = said[axis] if axis < len(said) > 1 else said[0]
    if beside in units.values():
        unit = beside
    elif suffix and suffix.lower() in units:
        unit = units[suffix.lower()]
    else:
        unit = next(iter(units.values()))
    slides = robot is not None and axis < robot.n_axes and robot.axis_is_prismatic[axis]
    return _SLIDING.get(unit, unit) if slides else unit


def _map_of(found: _Found, name: str, table: object, robot: Robot | None) -> ColumnMap:
    """Return the column map of what was found; raises LogError for what is missing."""
    n = 1 + max((axis for _, axis in found.signals), default=0)
    n = n if robot is None else max(n, robot.n_axes)
    names = [*found.arrays, *found.others]
    for k in range(n):
        if ("position", k) not in found.signals:
            raise LogError(f"{name}: {_missing(f'position_{k + 1}', 'rad', found, names)}")
    known = {field for field, _ in found.signals}
    if not known & {"torque", "position_ref"}:
        raise LogError(f"{name}: {_missing('torque_cmd_1', 'Nm', found, names)}")
    step = getattr(table, "attrs", {}).get("sample_time_s")
    if found.time is None and step is None:
        raise LogError(f"{name}: {_missing('time_s', 's', found, names)}")
    axes: list[dict[str, Any]] = [{} for _ in range(n)]
    for (field, k), (entry, unit) in found.signals.items():
        axes[k][field] = {"name": entry, "unit": unit}
    given: dict[str, Any] = {"axis": axes}
    if found.time is not None:
        given["time"] = dict(zip(("name", "unit"), found.time, strict=True))
    else:
        given["sample_rate_hz"] = 1.0 / float(cast(float, step))
    return ColumnMap.model_validate(given)


def _missing(wanted: str, unit: str, found: _Found, names: Sequence[str]) -> str:
    """Return what is said of a column that is not there, with the name that was perhaps meant for it."""
    near = nearest(wanted, found.others)
    meant = "" if near is None else f". Did you mean {wanted!r} by {near!r}?"
    listed = ", ".join(map(short, names[:_SHOWN])) or "nothing"
    more = ", ..." if len(names) > _SHOWN else ""
    return (
        f"{wanted}: expected a column {wanted} [{unit}], or a column map (columns=...), got "
        f"{listed}{more}{meant}"
    )
