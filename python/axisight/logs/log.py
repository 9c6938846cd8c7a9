"""One measured run in SI units on a uniform time grid."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import not_negative, positive
from axisight.display import html
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.logs.load import Load
from axisight.logs.run_up import RunUp

if TYPE_CHECKING:
    from pathlib import Path

    from axisight.logs.recorded import RecordedRows

Floats = NDArray[np.float64]
DIRECTIONS = ("x", "y", "z")
"""Directions of an accelerometer, in the order of its columns."""
AxisKind = Literal["revolute", "prismatic"]

RESAMPLED = "resampled linearly"
"""First words of the note on a log whose irregular time stamps were interpolated."""

# Log field -> (name in the Dataset, unit of a revolute axis, unit of a prismatic axis)
_VARIABLES = {
    "position_rad": ("position", "rad", "m"),
    "torque_nm": ("torque", "Nm", "N"),
    "position_ref_rad": ("position_ref", "rad", "m"),
    "velocity_ref_rad_s": ("velocity_ref", "rad/s", "m/s"),
    "velocity_rad_s": ("velocity", "rad/s", "m/s"),
    "joint_position_rad": ("joint_position", "rad", "m"),
    "temperature_c": ("temperature", "degC", "degC"),
}


def not_logged(shape: tuple[int, ...]) -> Floats:
    """Return the torque of a log without torque: NaN of this shape (n, axes)."""
    return np.full(shape, np.nan)


@summarized
@dataclass(frozen=True, eq=False, kw_only=True)
class Log:
    """A run of `n` samples on `axes` driven axes.

    `time_s` has shape (n,), starts at 0 and is uniform with step `sample_time_s` (s). Every other
    array has shape (n, axes): motor-side `position_rad` (rad), `torque_nm` (Nm; all NaN if it was not
    logged), `position_ref_rad` (rad, targets of the position), `velocity_ref_rad_s` and
    `velocity_rad_s` (rad/s), joint-side `joint_position_rad` (rad) and `temperature_c` (degC).
    `acceleration_m_s2` holds the readings (n, 3) [m/s^2] of each accelerometer by its name, along its directions
    x, y and z: acceleration minus gravity, NaN where none is measured.
    Optional arrays are None when the log has none of them; a measured optional array holds NaN in
    the columns of axes without that sensor. On an axis whose `axis_kinds` entry is "prismatic", rad
    reads m and Nm reads N.

    `start_rad` (axes,) (rad) are the driven joint angles at which a simulation of this run starts, at
    rest; None means the robot's operating point. `run_up` is the simulated motion before a run that begins in
    motion; None if the run begins at rest.

    `load` is what the arm carried during this run; None if the robot describes it.

    `nominal_nm_a` (axes,) concerns axes whose torque was logged as a current with an unknown torque constant.
    For such an axis it is the constant (Nm/A) by which `torque_nm` was computed, or NaN if `torque_nm` is
    still the current (A). For other axes it is None; it may be empty if no axis is of this kind.

    `period_s` is the excitation's period (s) when it is periodic. `notes` says what reading changed
    (time grid replaced, resampled). `recorded` has the rows before they were resampled; None if they were not.
    Raises InputError when shapes disagree.
    """

    name: str
    sample_time_s: float
    time_s: Floats
    torque_nm: Floats
    position_rad: Floats
    source: Path
    position_ref_rad: Floats | None = None
    velocity_ref_rad_s: Floats | None = None
    velocity_rad_s: Floats | None = None
    joint_position_rad: Floats | None = None
    temperature_c: Floats | None = None
    acceleration_m_s2: Mapping[str, Floats] = dataclasses.field(default_factory=dict)
    start_rad: Floats | None = None
    run_up: RunUp | None = None
    excitation: str | None = None
    period_s: float | None = None
    axis_kinds: tuple[AxisKind, ...] = ()
    notes: tuple[str, ...] = ()
    nominal_nm_a: tuple[float | None, ...] = ()
    recorded: RecordedRows | None = None
    load: Load | None = None

    def __post_init__(self) -> None:
        """Check the shapes and fill in revolute axes."""
        if self.time_s.ndim != 1:
            raise InputError(f"time_s: expected shape (n,), got {self.time_s.shape}")
        if self.position_rad.ndim != 2:
            raise InputError(
                f"position_rad: expected shape (n, axes), got {self.position_rad.shape}"
            )
        shape = (self.time_s.size, self.position_rad.shape[1])
        for field in _VARIABLES:
            values = getattr(self, field)
            if values is not None and values.shape != shape:
                raise InputError(f"{field}: expected shape {shape}, got {values.shape}")
        for name, readings in self.acceleration_m_s2.items():
            if readings.shape != (shape[0], len(DIRECTIONS)):
                raise InputError(
                    f"acceleration_m_s2[{name!r}]: expected shape {(shape[0], len(DIRECTIONS))}, got "
                    f"{readings.shape}"
                )
        if self.start_rad is not None and self.start_rad.shape != shape[1:]:
            raise InputError(f"start_rad: expected shape {shape[1:]}, got {self.start_rad.shape}")
        if self.run_up is not None and self.run_up.position_rad.shape[1:] != shape[1:]:
            got = self.run_up.position_rad.shape
            raise InputError(f"run_up: expected shape (m, {shape[1]}), got {got}")
        if not self.axis_kinds:
            object.__setattr__(self, "axis_kinds", ("revolute",) * shape[1])
        if len(self.axis_kinds) != shape[1]:
            raise InputError(f"axis_kinds: expected {shape[1]} entries, got {len(self.axis_kinds)}")
        if len(self.nominal_nm_a) not in (0, shape[1]):
            raise InputError(
                f"nominal_nm_a: expected {shape[1]} entries, got {len(self.nominal_nm_a)}"
            )

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Return a title and rows for the repr: signals with range and unit."""
        rows = [
            (f"{name} {axis}", f"{low} to {high} {unit}")
            for name, axis, unit, low, high in self._ranges()
        ]
        return f"Log {self._title()}", [*rows, ("from", str(self.source))]

    def _repr_html_(self) -> str:
        """Return the signals with unit and range on every axis as HTML, for notebooks."""
        head = ("signal", "axis", "unit", "least", "largest")
        return html.page(
            self._title(),
            html.table(head, self._ranges(), "Signals"),
            html.lines([f"from {self.source}", *self.notes]),
        )

    def _title(self) -> str:
        return (
            f"{self.name}: {self.duration_s:g} s, {self.n_samples} samples at "
            f"{self.sample_rate_hz:.6g} Hz, {self.n_axes} axes"
        )

    def _ranges(self) -> list[tuple[str, ...]]:
        """Return signal, axis, unit, smallest and largest value of every signal that was logged."""
        rows = []
        for field, (name, _, _) in _VARIABLES.items():
            found = getattr(self, field)
            for i in range(0 if found is None else self.n_axes):
                there = found[np.isfinite(found[:, i]), i]
                if there.size:
                    unit = self._unit(field, i)
                    span = map(html.number, (there.min(), there.max()))
                    rows.append((name, str(i + 1), unit, *span))
        for name, x in self._readings():
            rows.append((name, "", "m/s^2", *map(html.number, (np.nanmin(x), np.nanmax(x)))))
        return rows

    def _readings(self) -> list[tuple[str, Floats]]:
        """Return name and values (n,) of every reading of an accelerometer that was logged."""
        return [
            (f"acceleration_{name}_{direction}", readings[:, i])
            for name, readings in self.acceleration_m_s2.items()
            for i, direction in enumerate(DIRECTIONS)
            if np.isfinite(readings[:, i]).any()
        ]

    def _unit(self, field: str, axis: int) -> str:
        """Return the unit of a field on an axis (from 0)."""
        _, revolute, prismatic = _VARIABLES[field]
        nominal = self.nominal_nm_a[axis] if self.nominal_nm_a else None
        if field == "torque_nm" and nominal is not None and math.isnan(nominal):
            return "A"
        return revolute if self.axis_kinds[axis] == "revolute" else prismatic

    @property
    def has_torque(self) -> bool:
        """Whether torque was logged."""
        return not np.isnan(self.torque_nm).all()

    @property
    def n_axes(self) -> int:
        """Number of driven axes."""
        return int(self.position_rad.shape[1])

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return int(self.time_s.size)

    @property
    def sample_rate_hz(self) -> float:
        """Samples per second."""
        return 1.0 / self.sample_time_s

    @property
    def lead(self) -> int:
        """Number of samples of the run-up; 0 without one."""
        return 0 if self.run_up is None else self.run_up.n_samples

    def led(self, field: Literal["position_rad", "torque_nm", "velocity_ref_rad_s"]) -> Floats:
        """Return a signal `field` (lead + n, axes) of the run-up followed by the run.

        Raises InputError if the log does not have the signal.
        """
        own: Floats | None = getattr(self, field)
        if own is None:
            raise InputError(f"log {self.name!r}: expected {field}, got none")
        if self.run_up is None:
            return own
        before: Floats = getattr(self.run_up, field)
        return np.concatenate([before, own])

    @property
    def is_resampled(self) -> bool:
        """Whether reading interpolated irregular stamps, so that the rows differ from the recorded ones."""
        return any(note.startswith(RESAMPLED) for note in self.notes)

    @property
    def duration_s(self) -> float:
        """Number of samples times the sample time (s), so that a period of n samples lasts n sample times."""
        return self.n_samples * self.sample_time_s

    def part(self, start_s: float = 0.0, stop_s: float | None = None) -> Log:
        """Return a log of the samples from `start_s` to before `stop_s` (s), time starting at 0 again.

        A `stop_s` of None, or after the end, means the end of the log. A part shorter than the period is
        not periodic. Raises InputError for times that are not in order, a start after the end, and
        less than one second between.
        """
        start = not_negative("start_s", start_s)
        stop = self.duration_s if stop_s is None else positive("stop_s", stop_s)
        if start >= min(stop, self.duration_s):
            raise InputError(
                f"start_s: expected less than {min(stop, self.duration_s):g} s, got {start:g} s"
            )
        # Callers mean whole samples: a hundredth of a sample absorbs their rounding errors.
        first, last = (math.ceil(t / self.sample_time_s - 0.01) for t in (start, stop))
        last = min(last, self.n_samples)
        seconds = (last - first) * self.sample_time_s
        if seconds < 1.0 - 1e-9:
            raise InputError(
                f"start_s, stop_s: expected at least 1 s between, got {seconds:g} s of the log"
            )
        arrays = {name: getattr(self, name) for name in _VARIABLES}
        kept: dict[str, Any] = {
            name: None if x is None else x[first:last] for name, x in arrays.items()
        }
        kept["acceleration_m_s2"] = {n: x[first:last] for n, x in self.acceleration_m_s2.items()}
        periodic = self.period_s is not None and self.period_s <= seconds * (1 + 1e-9)
        note = f"from {first * self.sample_time_s:g} s to {last * self.sample_time_s:g} s"
        return dataclasses.replace(
            self,
            **kept,
            time_s=self.time_s[: last - first],
            start_rad=self.start_rad if first == 0 else None,
            run_up=self.run_up if first == 0 else None,
            period_s=self.period_s if periodic else None,
            recorded=None if self.recorded is None else self.recorded.part(start, stop),
            notes=(*self.notes, note),
        )

    def to_xarray(self) -> xr.Dataset:
        """Return a Dataset with dims (time, axis), 1-based `axis`, `units` and provenance attrs.

        If units differ between axes, `units` lists one unit per axis.
        """
        variables: dict[str, tuple[str | tuple[str, str], Floats, dict[str, str]]] = {}
        for field, (name, _, _) in _VARIABLES.items():
            values = getattr(self, field)
            if values is None:
                continue
            per_axis = [self._unit(field, axis) for axis in range(self.n_axes)]
            units = per_axis[0] if len(set(per_axis)) == 1 else ", ".join(per_axis)
            variables[name] = (("time", "axis"), values, {"units": units})
        for name, readings in self._readings():
            variables[name] = ("time", readings, {"units": "m/s^2"})
        attrs: dict[str, object] = {
            "name": self.name,
            "source": self.source.name,
            "sample_time_s": self.sample_time_s,
        }
        if self.excitation is not None:
            attrs["excitation"] = self.excitation
        if self.period_s is not None:
            attrs["period_s"] = self.period_s
        if self.notes:
            attrs["notes"] = "; ".join(self.notes)
        coords = {
            "time": ("time", self.time_s, {"units": "s"}),
            "axis": ("axis", np.arange(1, self.n_axes + 1), {"long_name": "driven axis, from 1"}),
        }
        return xr.Dataset(variables, coords=coords, attrs=attrs)
