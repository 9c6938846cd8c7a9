"""The column map `axisight.columns/1`: where a foreign file keeps its signals, in which unit."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

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
            raise ValueError(f"counts_per_rev is needed with unit {unit!r}")
        if self.scale == 0:
            raise ValueError("scale must not be zero")
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
            raise ValueError("scale (Nm or N per V) is needed with unit 'V'")
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
                    f"{field} in {signal.unit} does not go with position in {self.position.unit}"
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
            raise ValueError("give sample_rate_hz, [time], or both")
        return self


def describe_validation(error: ValidationError) -> str:
    """Return pydantic's findings as "field: message (got value)", joined by semicolons."""
    parts = []
    items = error.errors()
    for item in items[:_SHOWN]:
        path = ".".join(short(str(key)) for key in item["loc"]) or "(whole file)"
        message = short(item["msg"], 200)
        if item["type"] == "extra_forbidden":
            parts.append(f"{path}: expected a known key, got an unknown one")
        elif item["type"] in {"missing", "value_error"}:
            parts.append(f"{path}: {message}")
        else:
            parts.append(f"{path}: {message}, got {shown(item['input'])}")
    more = [f"and {len(items) - _SHOWN} more"] if len(items) > _SHOWN else []
    return "; ".join([*parts, *more])
