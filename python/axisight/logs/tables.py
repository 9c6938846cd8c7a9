"""Make logs from tables in memory: pandas DataFrames, xarray Datasets, mappings of arrays."""

from __future__ import annotations

import dataclasses
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import ValidationError

from axisight.arguments import nearest, positive, short, shown, words
from axisight.errors import InputError, LogError
from axisight.logs.columns import ColumnMap, as_unit, describe_validation
from axisight.logs.gather import gather_arrays
from axisight.logs.log import Log
from axisight.logs.map_files import AnyMap, load_column_map
from axisight.logs.native import ACCELERATION
from axisight.logs.reading import log_of
from axisight.logs.units import PRISMATIC_UNITS, REVOLUTE_UNITS, AccelerationUnit
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
# Default unit of a revolute axis -> default unit of a prismatic axis.
_SLIDING = {"rad": "m", "rad/s": "m/s", "Nm": "N", "degC": "degC"}
_TIME_UNITS = ("s", "ms", "us", "ns")
# Units in names that no signal here has. They are recognized so that they can be refused.
_FOREIGN = {
    **{"knm": "kNm", "mnm": "mNm", "ncm": "Ncm", "kn": "kN", "ma": "mA", "mv": "mV", "v": "V"},
    **{"mrad": "mrad", "mrad_s": "mrad/s", "counts": "counts", "counts_s": "counts/s"},
    **{"degree": "degree", "degrees": "degrees", "radian": "radian", "radians": "radians"},
    **{"cm": "cm", "um": "um"},
}
_MAP = "a column map (columns=...)"
_TIMES = re.compile(r"(?:time|t|timestamp)(?:_(s|ms|us|ns))?", re.IGNORECASE)
# A message lists at most this many names.
_SHOWN = 12


@dataclass(frozen=True)
class _Column:
    """A named array (n,) or (n, axes), its stated unit, and the labels of its second dimension."""

    name: str
    values: NDArray[Any]
    units: str = ""
    axes: tuple[Any, ...] | None = None


@dataclass
class _Found:
    """The recognized columns: (name, unit) by field and axis (from 0) and of the time; other names.

    ``accelerometers`` are tables of a column map, by name.
    """

    signals: dict[tuple[str, int], tuple[str, str]]
    arrays: dict[str, NDArray[Any]]
    time: tuple[str, str] | None
    others: list[str]
    accelerometers: dict[str, dict[str, Any]]


def is_table(value: object) -> bool:
    """Whether a value is a table in memory: a DataFrame, Dataset, mapping, or object with `to_pandas`."""
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
        `velocity_1`, `joint_position_1`, `temperature_1`, `acceleration_NAME_x` of the accelerometer
        NAME, and `time_s` (or the index). The number
        may be a joint name of the robot, and is left out where an array has all axes. A unit may
        follow: `position_deg_1`, `velocity_rpm_1`, `torque_nm_1`, `time_ms`. The attribute `units`
        of a Dataset counts first; without any unit, signals are in rad, rad/s, Nm, degC and s, on
        prismatic axes in m, m/s and N. A unit that the signal cannot have is refused.
    name : name of the log, also in messages.
    robot, currents : as in `read_log`.

    The attributes `sample_time_s` (s), `period_s` (s) and `excitation` of the table count if they are set.
    Raises LogError with the column, what was expected, what came, and the nearest name.

    """
    listed, attrs = _columns(table, name), _attributes(table, name)
    if columns is not None:
        given = load_column_map(columns) if isinstance(columns, Path | str) else columns
        arrays = {column.name: column.values for column in listed}
    else:
        found = _found(listed, name, robot)
        given, arrays = _map_of(found, name, attrs.get("sample_time_s"), robot), found.arrays
    log = log_of(gather_arrays(arrays, name, given, robot), robot=robot, currents=currents)
    kept = {key: attrs[key] for key in ("excitation", "period_s") if key in attrs}
    return dataclasses.replace(log, name=name, source=Path(name), **kept)


def _is_frame(value: object) -> bool:
    pandas = sys.modules.get("pandas")  # not imported: then no value is a DataFrame
    return pandas is not None and isinstance(value, pandas.DataFrame)


def _converts(value: object) -> bool:
    return hasattr(value, "to_pandas") and not isinstance(value, xr.DataArray)


def _columns(table: object, name: str) -> list[_Column]:
    """Return the arrays of a table with their names; raise LogError for a repeated name."""
    if isinstance(table, xr.Dataset):
        found = list(_of_dataset(table))
    elif isinstance(table, Mapping):
        found = [_Column(str(key), _array(values, str(key), name)) for key, values in table.items()]
    else:
        frame = table if _is_frame(table) else cast(Any, table).to_pandas()
        found = list(_of_frame(frame))
    names = [column.name for column in found]
    twice = next((one for one in names if names.count(one) > 1), None)
    if twice is not None:
        raise LogError(f"{name}: {short(twice)}: expected one column of that name, got several")
    return found


def _array(values: object, column: str, name: str) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except (TypeError, ValueError) as error:  # lists of unequal lengths
        raise LogError(
            f"{name}: {short(column)}: expected an array (n,) or (n, axes), got {shown(values)}"
        ) from error


def _of_frame(frame: Any) -> Iterator[_Column]:
    index, names = frame.index, [_flat(name) for name in frame.columns]
    if index.dtype.kind in "mM":
        since = index - index[0] if len(index) else index - index
        yield _Column("time_s", np.asarray(since / np.timedelta64(1, "s"), float))
    elif index.name is not None and str(index.name) not in names:
        yield _Column(str(index.name), np.asarray(index))
    for k, name in enumerate(names):
        yield _Column(name, np.asarray(frame.iloc[:, k].to_numpy()))


def _flat(name: object) -> str:
    """Return the name of a column, with the levels of a MultiIndex joined: ("position", 1) is position_1."""
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
    """Return the columns by the meaning of their names; raise LogError for two columns of one meaning."""
    joints = [] if robot is None else robot.axis_names
    found = _Found({}, {}, None, [], {})
    pattern = _pattern(joints)
    for column in columns:
        time = _TIMES.fullmatch(column.name)
        if time and column.values.ndim == 1:
            if found.time is not None:
                raise LogError(
                    f"{name}: time: expected one time column, got {found.time[0]} and {column.name}; "
                    f"{_MAP} says which one is meant"
                )
            units = column.units.strip()
            if units and units not in _TIME_UNITS:
                raise LogError(f"{name}: {_wrong_unit(column.name, _TIME_UNITS, units)}")
            found.time = (column.name, units or (time[1] or "s").lower())
            found.arrays[column.name] = column.values
            continue
        reading = ACCELERATION.match(column.name)
        if reading is not None and column.values.ndim == 1:
            _take_reading(found, column, reading, name)
            continue
        match = pattern.fullmatch(column.name)
        if match is None:
            found.others.append(column.name)
            continue
        field = _FIELDS[match["stem"].lower()]
        suffixes = [unit for unit in (match["before"], match["behind"]) if unit]
        for k, entry, values, units in _by_axis(column, match["axis"], joints, name):
            slides = _slides(robot, k)
            try:
                unit = _unit(entry, [units, *map(_written, suffixes)], field, slides)
            except LogError as error:
                raise LogError(f"{name}: {error}") from None
            if (field, k) in found.signals:
                first = found.signals[field, k][0]
                raise LogError(
                    f"{name}: {field} of axis {k + 1}: expected one column, got {first} and {entry}; "
                    f"{_MAP} says which one is meant"
                )
            found.signals[field, k] = (entry, unit)
            found.arrays[entry] = values
    return found


def _take_reading(found: _Found, column: _Column, match: re.Match[str], name: str) -> None:
    """Add a reading of an accelerometer to the columns found; raise LogError for a wrong unit."""
    unit = column.units.strip() or "m/s^2"
    if unit not in get_args(AccelerationUnit):
        raise LogError(f"{name}: {_wrong_unit(column.name, get_args(AccelerationUnit), unit)}")
    sensor = found.accelerometers.setdefault(match[1], {"name": match[1]})
    sensor[match[2]] = {"name": column.name, "unit": unit}
    found.arrays[column.name] = column.values


def _pattern(joints: Sequence[str]) -> re.Pattern[str]:
    """Return the regular expression of column names: signal, axis, and a unit before or after the axis."""
    stems = "|".join(_FIELDS)
    known = {unit for units in (*_UNITS.values(), _FOREIGN) for unit in units}
    known -= {joint.lower() for joint in joints}  # `torque_a` means the joint if one is called a
    units = "|".join(sorted(known, key=len, reverse=True))
    axes = "|".join([r"[1-9]\d{0,3}", *(re.escape(joint) for joint in joints)])
    return re.compile(
        rf"(?P<stem>{stems})(?:_(?P<before>{units}))?(?:_(?P<axis>{axes}))?(?:_(?P<behind>{units}))?",
        re.IGNORECASE,
    )


def _by_axis(
    column: _Column, place: str | None, joints: Sequence[str], name: str
) -> Iterator[tuple[int, str, NDArray[Any], str]]:
    """Yield axis (from 0), name, values, unit of each signal in a column; raise LogError for a wrong axis."""
    values, units = column.values, column.units.strip()
    if values.ndim > 2:
        raise LogError(
            f"{name}: {short(column.name)}: expected shape (n,) or (n, axes), got {values.shape}"
        )
    if place is not None and values.ndim == 2:
        if values.shape[1] != 1:
            raise LogError(
                f"{name}: {short(column.name)}: expected one signal, as the name has an axis, got "
                f"shape {values.shape}"
            )
        values = values[:, 0]
    if values.ndim < 2:
        yield _axis_of(column.name, place, joints, name) - 1, column.name, values, units
        return
    n = values.shape[1]
    numbers = _numbers(column, n, joints, name)
    # A Dataset with axes of both kinds lists one unit per axis.
    each = [unit.strip() for unit in units.split(",")]
    each = each if len(each) == n else [units] * n
    for k, number in enumerate(numbers):
        yield number - 1, f"{column.name}[{k}]", values[:, k], each[k]


def _axis_of(column: str, place: str | None, joints: Sequence[str], name: str) -> int:
    """Return the axis (from 1) in a name, 1 if it has none; raise LogError for an unknown joint."""
    if place is None:
        return 1
    if place.isdecimal():
        return int(place)
    try:
        return axis_number(place, joints)
    except InputError as error:  # a joint in another case
        raise LogError(f"{name}: {short(column)}: {error}") from error


def _numbers(column: _Column, n: int, joints: Sequence[str], name: str) -> list[int]:
    """Return the axes (from 1) of an array's columns; [] if a label is not a driven joint."""
    usual = list(range(1, n + 1))
    labels = [str(label) if isinstance(label, str) else label for label in column.axes or usual]
    texts = [label for label in labels if isinstance(label, str)]
    if len(texts) < n or all(label.isdecimal() for label in texts):
        if [str(label).removesuffix(".0") for label in labels] != [str(k) for k in usual]:
            raise LogError(
                f"{name}: {short(column.name)}: axes: expected the labels 1 to {n} in order, or joint "
                f"names, got {shown(labels)}"
            )
        return usual
    if not joints:
        return usual
    if not set(labels) <= set(joints):  # an array over all joints, elastic ones too
        return []
    return [axis_number(label, joints) for label in labels]


def _written(suffix: str) -> str:
    """Return the unit for a suffix of a name: `rad_s` is rad/s."""
    meant = {**_FOREIGN, **{key: unit for units in _UNITS.values() for key, unit in units.items()}}
    return meant[suffix.lower()]


def _unit(column: str, given: Sequence[str], field: str, slides: bool | None) -> str:
    """Return the unit of a signal: the first one given, or the usual one of the field.

    ``slides``: whether the axis slides; None if the robot is unknown. Raises LogError for a unit of
    another quantity or another kind of axis.
    """
    known = list(_UNITS[field].values())
    if slides is not None:
        wrong = REVOLUTE_UNITS if slides else PRISMATIC_UNITS
        known = [unit for unit in known if unit not in wrong]
    stated = [unit for unit in given if unit]
    for unit in stated:
        if unit not in known:
            raise LogError(_wrong_unit(column, known, unit))
    usual = next(iter(_UNITS[field].values()))
    return stated[0] if stated else _SLIDING[usual] if slides else usual


def _slides(robot: Robot | None, axis: int) -> bool | None:
    """Return whether an axis (from 0) is prismatic; None if no robot says so."""
    known = robot is not None and axis < robot.n_axes
    return bool(robot.axis_is_prismatic[axis]) if robot is not None and known else None


def _wrong_unit(column: str, known: Sequence[str], unit: str) -> str:
    """Return the message for a unit that a column cannot have."""
    return (
        f"{short(column)}: unit: expected one of {', '.join(known)}, got {shown(unit)}; {_MAP} gives "
        f"other units and scales{as_unit(unit)}"
    )


def _map_of(found: _Found, name: str, step: float | None, robot: Robot | None) -> ColumnMap:
    """Return the column map of the recognized columns; raise LogError for a missing one.

    ``step``: sample time (s) for a table without time stamps.
    """
    n = 1 + max((axis for _, axis in found.signals), default=0)
    n = n if robot is None else max(n, robot.n_axes)
    names = [*found.arrays, *found.others]
    for k in range(n):
        if ("position", k) not in found.signals:
            raise LogError(f"{name}: {_missing(f'position_{k + 1}', 'rad', found, names)}")
    known = {field for field, _ in found.signals}
    if not known & {"torque", "position_ref"}:
        raise LogError(f"{name}: {_missing('torque_cmd_1', 'Nm', found, names)}")
    if found.time is None and step is None:
        raise LogError(f"{name}: {_missing('time_s', 's', found, names)}")
    axes: list[dict[str, Any]] = [{} for _ in range(n)]
    for (field, k), (entry, unit) in found.signals.items():
        axes[k][field] = {"name": entry, "unit": unit}
    given: dict[str, Any] = {"axis": axes, "accelerometer": list(found.accelerometers.values())}
    if found.time is not None:
        given["time"] = dict(zip(("name", "unit"), found.time, strict=True))
    elif step is not None:
        given["sample_rate_hz"] = 1.0 / step
    try:
        return ColumnMap.model_validate(given)
    except ValidationError as error:
        raise LogError(f"{name}: {describe_validation(error, ColumnMap)}") from error


def _attributes(table: object, name: str) -> dict[str, Any]:
    """Return the attributes of a table that describe the log; raise LogError for a wrong value."""
    attrs = getattr(table, "attrs", {})
    checks: dict[str, Callable[[str, object], Any]] = {
        "sample_time_s": positive,
        "period_s": positive,
        "excitation": words,
    }
    stated = {key: attrs[key] for key in checks if attrs.get(key) is not None}
    try:
        return {key: checks[key](f"attrs[{key!r}]", value) for key, value in stated.items()}
    except InputError as error:
        raise LogError(f"{name}: {error}") from error


def _missing(wanted: str, unit: str, found: _Found, names: Sequence[str]) -> str:
    """Return the message for a missing column, with the name that was perhaps meant."""
    near = nearest(wanted, found.others)
    meant = "" if near is None else f". Did you mean {wanted!r} by {near!r}?"
    listed = ", ".join(map(short, names[:_SHOWN])) or "nothing"
    more = ", ..." if len(names) > _SHOWN else ""
    return (
        f"{wanted}: expected a column {wanted} [{unit}], or a column map (columns=...), got "
        f"{listed}{more}{meant}"
    )
