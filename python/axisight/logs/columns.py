"""The column map `axisight.columns/1`: where a foreign file keeps its signals, in which unit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from axisight.arguments import did_you_mean, short, shown
from axisight.logs.units import (
    PRISMATIC_UNITS,
    REVOLUTE_UNITS,
    AccelerationUnit,
    PositionUnit,
    TemperatureUnit,
    TimeUnit,
    TorqueUnit,
    VelocityUnit,
)

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(min_length=1)]


UNKNOWN = "unknown"
"""Scale of a current whose torque constant is unknown."""

# A message lists at most this many faults of one file.
_SHOWN = 8


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Address(_Strict):
    """The place of one signal in a file.

    `name` is a column of a table or a variable of a MAT, HDF5 or NPZ file; fields of structs and
    members of groups follow after dots (`rec.meas.q`). `index` selects from a matrix in NumPy order
    and counts from 0: "1,:" is the second row, ":,2" the third column, a lone integer the entry of
    the first dimension. `file` names another file in the log's folder that holds this signal. `note`
    is added to the notes of every log that is read with this address.
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
    """Time stamps; `resample_hz` (Hz) interpolates irregular ones linearly onto a uniform grid.

    `resample_hz = "mean"` takes the mean rate of the stamps, for logs whose rate is not known beforehand;
    uniform stamps are then not resampled.

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

    @property
    def line(self) -> tuple[float | str, float | str]:
        """Return (scale, offset) of scale * (value - offset); a text names a scalar in the file."""
        return 1.0 if self.scale is None else self.scale, 0.0


Pair = tuple[Finite, Finite]


class PositionColumn(_Signal):
    """Position: SI value = sign * scale * (value - offset) * unit factor.

    `offset` is what the column reads at position zero, in the unit of the column, before scale and sign.
    `scale` and `offset` may name scalars in the file. Instead of scale, sign and offset, two readings
    (`raw_range`) and their positions (`unit_range`, in `unit`) may be given; a straight line joins them.
    """

    unit: PositionUnit
    offset: float | Text = 0.0
    raw_range: Pair | None = None
    unit_range: Pair | None = None

    @model_validator(mode="after")
    def _line(self) -> PositionColumn:
        if isinstance(self.offset, float) and not math.isfinite(self.offset):
            raise ValueError(f"offset: expected a finite number, got {self.offset}")
        ranges = {"raw_range": self.raw_range, "unit_range": self.unit_range}
        given = {name: ends for name, ends in ranges.items() if ends is not None}
        if len(given) == 1:
            (there,) = given
            (missing,) = ranges.keys() - given
            raise ValueError(f"expected {missing} beside {there}, got none")
        for name, (low, high) in given.items():
            if low == high:
                raise ValueError(
                    f"{name}: expected two numbers that differ, got [{low:g}, {high:g}]"
                )
        usual = {"scale": None, "sign": 1, "offset": 0.0}
        beside = [key for key, value in usual.items() if getattr(self, key) != value]
        if given and beside:
            listed = ", ".join(beside)
            raise ValueError(
                f"expected raw_range and unit_range to give scale, sign and offset, got {listed} beside them"
            )
        return self

    @property
    def line(self) -> tuple[float | str, float | str]:
        """Return (scale, offset) of scale * (value - offset); a text names a scalar in the file."""
        if self.raw_range is None or self.unit_range is None:
            return super().line[0], self.offset
        (raw, other_raw), (value, other) = self.raw_range, self.unit_range
        scale = (other - value) / (other_raw - raw)
        return scale, raw - value / scale


class VelocityColumn(_Signal):
    """Velocity, measured or reference: SI value = sign * scale * value * unit factor."""

    unit: VelocityUnit


class TorqueColumn(_Signal):
    """Torque or force; for A and V, `scale` states Nm (or N) per A or V.

    Without a scale, A is a motor current: `read_log` then needs a robot that states its torque constant. With
    `scale = "unknown"`, a diagnosis finds the constant.
    """

    unit: TorqueUnit

    @model_validator(mode="after")
    def _scaled(self) -> TorqueColumn:
        if self.unit == "V" and self.scale is None:
            raise ValueError("unit 'V': expected scale (Nm or N per V) beside it, got none")
        return self

    @property
    def line(self) -> tuple[float | str, float | str]:
        """Return (scale, 0) as for other signals; the scale of a current with an unknown constant is 1."""
        return (1.0, 0.0) if self.is_unknown else super().line

    @property
    def is_current(self) -> bool:
        """Whether the signal is a motor current that the torque constant of the motor turns into torque."""
        return self.unit == "A" and (self.scale is None or self.is_unknown)

    @property
    def is_unknown(self) -> bool:
        """Whether the signal is a motor current with an unknown torque constant."""
        return self.unit == "A" and self.scale == UNKNOWN


class TemperatureColumn(_Signal):
    """Temperature, in degC or K."""

    unit: TemperatureUnit = "degC"


class AccelerationColumn(_Signal):
    """A direction of an accelerometer: the acceleration minus gravity, in m/s^2, mm/s^2 or g."""

    unit: AccelerationUnit


class AccelerometerColumns(_Strict):
    """The measured directions of an accelerometer; `name` is that of the robot's `[[accelerometer]]`."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
    x: AccelerationColumn | None = None
    y: AccelerationColumn | None = None
    z: AccelerationColumn | None = None

    @property
    def readings(self) -> dict[str, AccelerationColumn]:
        """The columns of the measured directions, by direction."""
        columns = {"x": self.x, "y": self.y, "z": self.z}
        return {direction: c for direction, c in columns.items() if c is not None}

    @model_validator(mode="after")
    def _some(self) -> AccelerometerColumns:
        if not self.readings:
            raise ValueError("expected a column x, y or z, got none")
        return self


def _different(
    accelerometers: tuple[AccelerometerColumns, ...],
) -> tuple[AccelerometerColumns, ...]:
    names = [one.name for one in accelerometers]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"expected different names, got {twice!r} twice")
    return accelerometers


Accelerometers = Annotated[tuple[AccelerometerColumns, ...], AfterValidator(_different)]


class AxisColumns(_Strict):
    """The signals of one driven axis.

    `read_log` requires that all axes have a torque, or that all have `position_ref`; `check_log` does not.
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
    r"""The format of a CSV file; without a header, columns are named "0", "1" and so on.

    `separator` is one character, `\s+` for white space, or "auto". "auto" takes tab, semicolon or comma, the
    first of them that the header contains, and a space if it contains none.
    """

    # One character: pandas takes longer text as a pattern, and a hostile pattern can take forever to match.
    separator: Annotated[str, Field(pattern=r"^(auto|.|\\s\+)$")] = ","
    decimal: Annotated[str, Field(min_length=1, max_length=1)] = "."
    header: bool = True
    skip_rows: Annotated[int, Field(ge=0)] = 0


class ColumnMap(_Strict):
    """A column map for a fixed number of axes, in the order of the axes.

    `sample_rate_hz` (Hz) is a number, or the name of a scalar in the file. `side` says whether positions,
    velocities and torques are motor-side or joint-side. The gear ratios of the robot convert joint-side
    signals to the motor side.
    """

    schema_: Literal["axisight.columns/1"] = Field(default="axisight.columns/1", alias="schema")
    sample_rate_hz: Positive | Text | None = None
    side: Literal["motor", "joint"] = "motor"
    time: TimeColumn | None = None
    axis: Annotated[tuple[AxisColumns, ...], Field(min_length=1)]
    accelerometer: Accelerometers = ()
    csv: CsvOptions = CsvOptions()

    @model_validator(mode="after")
    def _rate_known(self) -> ColumnMap:
        if self.time is None and self.sample_rate_hz is None:
            raise ValueError("expected sample_rate_hz, [time], or both, got neither")
        return self


def describe_validation(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the errors of pydantic as "field: expected ..., got ...", joined by semicolons.

    Entries of lists count from 1: "axis 2: torque.unit". For an unknown key, the text proposes the nearest
    key of ``model`` and its parts.
    """
    items = error.errors()
    # pydantic also reports a list with wrong entries as too short: that is not a second fault.
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
    known = _keys(model)
    parts = [f"{_place(item['loc'])}: {_fault(item, missing, known)}" for item in items[:_SHOWN]]
    more = [f"and {len(items) - _SHOWN} more"] if len(items) > _SHOWN else []
    return "; ".join([*parts, *more])


def _place(keys: tuple[int | str, ...]) -> str:
    """Return the path of a key: names joined by dots, list entries by number."""
    text = ""
    for key in keys:
        if isinstance(key, int):
            text += f" {key + 1}:"
        else:
            text += f"{'' if not text else ' ' if text.endswith(':') else '.'}{short(key)}"
    return text.removesuffix(":") or "(whole file)"


def _fault(
    item: ErrorDetails, missing: Sequence[tuple[int | str, ...]], known: Iterable[str]
) -> str:
    """Return what is wrong with a key, with a guess at the key meant; ``missing``: paths of missing keys."""
    kind, got = item["type"], shown(item["input"])
    if kind == "missing":
        return "expected this key, got none"
    if kind == "extra_forbidden":
        *parent, key = item["loc"]
        beside = [str(at[-1]) for at in missing if list(at[:-1]) == parent]
        meant = did_you_mean(str(key), beside) or did_you_mean(str(key), known)
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

# Unsupported units that people write -> (supported unit, factor that goes into `scale`)
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
    """Return a question that proposes the supported unit and scale for ``given``; "" if none is known."""
    if not isinstance(given, str) or given not in _OTHER_UNITS:
        return ""
    unit, factor = _OTHER_UNITS[given]
    scale = "" if factor == 1.0 else f" and scale = {factor:g}"
    return f". Did you mean unit = {unit!r}{scale}?"


def _keys(model: type[BaseModel]) -> list[str]:
    """Return the keys of a model and of all models inside it."""
    schema = model.model_json_schema()
    parts = [schema, *schema.get("$defs", {}).values()]
    return [key for part in parts for key in part.get("properties", ())]
