"""The column map `axisight.columns/1`: where a foreign file keeps its signals, in which unit."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from axisight.arguments import short, shown
from axisight.logs.units import (
    PRISMATIC_UNITS,
    REVOLUTE_UNITS,
    PositionUnit,
    TemperatureUnit,
    TimeUnit,
    TorqueUnit,
    VelocityUnit,
)

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Text = Annotated[str, Field(min_length=1)]


UNKNOWN = "unknown"
"""Scale of a current whose torque constant nobody knows."""

# Faults of one file that a message tells.
_SHOWN = 8


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Address(_Strict):
    """Where one signal is kept.

    `name` is a column of a table or a variable of a MAT, HDF5 or NPZ file; fields of structs and
    members of groups follow after dots (`rec.meas.q`). `index` picks from a matrix in NumPy order
    and counts from 0: "1,:" is the second row, ":,2" the third column, a lone integer the entry of
    the first dimension. `file` names another file in the log's folder that holds this signal. `note`
    is said of every log that is read by it.
    """

    name: Text
    index: Annotated[str, Field(pattern=r"^\s*(:|-?\d+)(\s*,\s*(:|-?\d+))*\s*$")] | int | None = (
        None
    )
    file: Text | None = None
    note: Text | None = None

    @property
    def label(self) -> str:
        """Return the address as it appears in messages."""
        index = "" if self.index is None else f"[{self.index}]"
        return short(f"{self.file + ':' if self.file else ''}{self.name}{index}", 200)


class TimeColumn(Address):
    """Time stamps; `resample_hz` interpolates irregular ones linearly onto a uniform grid.

    "mean" is the mean rate of the stamps, for logs whose rate nobody knows beforehand; stamps that are
    uniform stay as they are.

    Resampling is for logs stamped by a host computer. It has no anti-alias filter and bridges gaps
    by straight lines; the log's notes say so.
    """

    unit: TimeUnit = "s"
    resample_hz: Positive | Literal["mean"] | None = None


class _Signal(Address):
    scale: float | Text | None = None
    sign: Literal[1, -1] = 1
    counts_per_rev: Positive | None = None

    @model_validator(mode="after")
    def _counts(self) -> _Signal:
        unit = getattr(self, "unit", "")
        if unit in {"counts", "counts/s"} and self.counts_per_rev is None:
            raise ValueError(f"unit {unit!r}: expected counts_per_rev beside it, got none")
        if self.scale == 0:
            raise ValueError("scale: expected a number other than 0, got 0")
        return self


class PositionColumn(_Signal):
    """Position: SI value = sign * scale * value * unit factor. `scale` may name a file scalar."""

    unit: PositionUnit


class VelocityColumn(_Signal):
    """Velocity, measured or reference."""

    unit: VelocityUnit


class TorqueColumn(_Signal):
    """Torque or force; for A and V, `scale` states Nm (or N) per A or V.

    A without one is a current of the motor, which is read with a robot that states its torque constant; with
    "unknown" it is one whose constant nobody knows, for a diagnosis to find.
    """

    unit: TorqueUnit

    @model_validator(mode="after")
    def _scaled(self) -> TorqueColumn:
        if self.unit == "V" and self.scale is None:
            raise ValueError("unit 'V': expected scale (Nm or N per V) beside it, got none")
        return self

    @property
    def is_current(self) -> bool:
        """Whether it is a current of the motor, which its torque constant turns into torque."""
        return self.unit == "A" and (self.scale is None or self.is_unknown)

    @property
    def is_unknown(self) -> bool:
        """Whether nobody knows the torque constant of the motor."""
        return self.unit == "A" and self.scale == UNKNOWN


class TemperatureColumn(_Signal):
    """Temperature."""

    unit: TemperatureUnit = "degC"


class AxisColumns(_Strict):
    """The signals of one driven axis.

    A log is read only where all axes have a torque, or targets of their positions; a check needs neither.
    """

    position: PositionColumn
    torque: TorqueColumn | None = None
    position_ref: PositionColumn | None = None
    velocity_ref: VelocityColumn | None = None
    velocity: VelocityColumn | None = None
    joint_position: PositionColumn | None = None
    temperature: TemperatureColumn | None = None

    @property
    def prismatic(self) -> bool:
        """True when the position is in m or mm."""
        return self.position.unit in PRISMATIC_UNITS

    @model_validator(mode="after")
    def _one_kind(self) -> AxisColumns:
        wrong = REVOLUTE_UNITS if self.prismatic else PRISMATIC_UNITS
        for field in ("torque", "position_ref", "velocity_ref", "velocity", "joint_position"):
            signal = getattr(self, field)
            if signal is not None and signal.unit in wrong:
                raise ValueError(
                    f"{field}: expected a unit that goes with a position in {self.position.unit}, got "
                    f"{signal.unit}"
                )
        return self


class CsvOptions(_Strict):
    """How a CSV file is written; without a header, columns are named "0", "1" and so on.

    `separator` is one character, or "auto" for what stands between the names of the header.
    """

    # One character: pandas would take more for a pattern, which may take any time to search for.
    separator: Annotated[str, Field(pattern=r"^(auto|.|\\s\+)$")] = ","
    decimal: Annotated[str, Field(min_length=1, max_length=1)] = "."
    header: bool = True
    skip_rows: Annotated[int, Field(ge=0)] = 0


class ColumnMap(_Strict):
    """A whole map. `sample_rate_hz` is a number, or the name of a scalar in the file.

    `side` says whether positions, velocities and torques are those of motors or of joints; those of joints
    become the motors' by the gear ratios of the robot that the log is read for.
    """

    schema_: Literal["axisight.columns/1"] = Field(default="axisight.columns/1", alias="schema")
    sample_rate_hz: Positive | Text | None = None
    side: Literal["motor", "joint"] = "motor"
    time: TimeColumn | None = None
    axis: Annotated[tuple[AxisColumns, ...], Field(min_length=1)]
    csv: CsvOptions = CsvOptions()

    @model_validator(mode="after")
    def _rate_known(self) -> ColumnMap:
        if self.time is None and self.sample_rate_hz is None:
            raise ValueError("expected sample_rate_hz, [time], or both, got neither")
        return self


def describe_validation(error: ValidationError) -> str:
    """Return pydantic's findings as "field: expected ..., got ...", joined by semicolons.

    Entries of lists count from 1: "axis 2: torque.unit".
    """
    items = error.errors()
    # A list whose entries are wrong counts as empty too: that is no fault of its own.
    inner = [item["loc"] for item in items]
    items = [
        item
        for item in items
        if item["type"] != "too_short"
        or not any(
            len(at) > len(item["loc"]) and at[: len(item["loc"])] == item["loc"] for at in inner
        )
    ]
    missing = [item["loc"] for item in items if item["type"] == "missing"]
    parts = [f"{_place(item['loc'])}: {_fault(item, missing)}" for item in items[:_SHOWN]]
    more = [f"and {len(items) - _SHOWN} more"] if len(items) > _SHOWN else []
    return "; ".join([*parts, *more])


def _place(keys: tuple[int | str, ...]) -> str:
    """Return the place of a key: names with dots between, entries of lists by number."""
    text = ""
    for key in keys:
        if isinstance(key, int):
            text += f" {key + 1}:"
        else:
            text += f"{'' if not text else ' ' if text.endswith(':') else '.'}{short(key)}"
    return text.removesuffix(":") or "(whole file)"


def _fault(item: ErrorDetails, missing: Sequence[tuple[int | str, ...]]) -> str:
    """Return what is wrong with one key, and what was meant; ``missing``: keys that are not there."""
    kind, got = item["type"], shown(item["input"])
    if kind == "missing":
        return "expected this key, got none"
    if kind == "extra_forbidden":
        *parent, key = item["loc"]
        beside = [str(at[-1]) for at in missing if list(at[:-1]) == parent]
        near = get_close_matches(str(key), [*beside, *_keys()], n=1, cutoff=0.7)
        meant = f". Did you mean {near[0]!r}?" if near else ""
        return f"expected a known key, got an unknown one{meant}"
    if kind == "literal_error":
        expected = str(item["ctx"]["expected"]).replace("'", "").replace(" or ", ", ")
        return f"expected one of {expected}, got {got}{as_unit(item['input'])}"
    message = short(item["msg"], 200)
    if kind == "value_error":
        return message.removeprefix("Value error, ")
    for begin, said in _BEGINNINGS.items():
        if message.startswith(begin):
            message = said + message.removeprefix(begin)
    return f"{message}, got {got}"


_BEGINNINGS = {
    "Input should be ": "expected ",
    "String should ": "expected text to ",
    "Tuple should ": "expected a list to ",
    "List should ": "expected a list to ",
}

# Units that people write: the unit that is known, and the factor that goes into `scale`.
_OTHER_UNITS = {
    "kNm": ("Nm", 1e3),
    "mNm": ("Nm", 1e-3),
    "Ncm": ("Nm", 1e-2),
    "N.m": ("Nm", 1.0),
    "N*m": ("Nm", 1.0),
    "kN": ("N", 1e3),
    "mA": ("A", 1e-3),
    "mV": ("V", 1e-3),
    "mrad": ("rad", 1e-3),
    "mrad/s": ("rad/s", 1e-3),
    "grad": ("deg", 0.9),
    "degree": ("deg", 1.0),
    "degrees": ("deg", 1.0),
    "radian": ("rad", 1.0),
    "radians": ("rad", 1.0),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
}


def as_unit(given: object) -> str:
    """Return how a unit that is not known is written; empty for what is none."""
    if not isinstance(given, str) or given not in _OTHER_UNITS:
        return ""
    unit, factor = _OTHER_UNITS[given]
    scale = "" if factor == 1.0 else f" and scale = {factor:g}"
    return f". Did you mean unit = {unit!r}{scale}?"


def _keys() -> set[str]:
    """Return the keys of all tables of a column map."""
    tables: set[type[_Strict]] = {
        ColumnMap,
        AxisColumns,
        CsvOptions,
        TimeColumn,
        PositionColumn,
        TorqueColumn,
    }
    return {field.alias or name for table in tables for name, field in table.model_fields.items()}
