"""Check a log leniently: every problem is reported, none raised."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from axisight.arguments import short
from axisight.display import html
from axisight.display.summary import summarized
from axisight.errors import LogError
from axisight.logs.findings import Finding
from axisight.logs.gather import Channel, Gathered, gather
from axisight.logs.log import Floats
from axisight.logs.map_files import AnyMap
from axisight.logs.quality import check_signal
from axisight.logs.reading import grid_of
from axisight.logs.recorded import recorded_rows
from axisight.logs.rows import check_recorded, check_rows
from axisight.logs.unit_guess import check_units
from axisight.logs.validate import check_axes, check_finite, check_lengths

_UNITS = {
    "position": ("rad", "m"),
    "torque": ("Nm", "N"),
    "position_ref": ("rad", "m"),
    "velocity_ref": ("rad/s", "m/s"),
    "velocity": ("rad/s", "m/s"),
    "joint_position": ("rad", "m"),
    "temperature": ("degC", "degC"),
}


_GRAVEST = ("error", "warning", "ok")


@summarized
@dataclass(frozen=True)
class LogReport:
    """The findings of `check_log`; `sample_rate_hz` (Hz), `n_samples` and `n_axes` are None if unknown."""

    path: Path
    findings: tuple[Finding, ...]
    sample_rate_hz: float | None = None
    n_samples: int | None = None
    n_axes: int | None = None

    def _repr_html_(self) -> str:
        """Return every finding, errors first, as HTML for notebooks."""
        worst_first = sorted(self.findings, key=lambda f: _GRAVEST.index(f.severity))
        rows = [(f.severity, f.column, f.message) for f in worst_first]
        known = [
            "" if self.n_samples is None else f"{self.n_samples} samples",
            "" if self.sample_rate_hz is None else f"at {self.sample_rate_hz:.6g} Hz",
            "" if self.n_axes is None else f"{self.n_axes} axes",
        ]
        verdict = "can be read" if self.ok else "cannot be read"
        title = ", ".join(filter(None, [f"{self.path}: {verdict}", *known]))
        return html.page(title, html.table(("severity", "column", "finding"), rows, "Findings"))

    @property
    def ok(self) -> bool:
        """True if there is no error; warnings may remain.

        `read_log` then reads the file, if it gets the robot and the option `currents` that the file needs.
        """
        return not any(finding.severity == "error" for finding in self.findings)


def check_log(
    path: Path | str,
    columns: AnyMap | Path | str | None = None,
    *,
    max_bytes: int | None = None,
) -> LogReport:
    """Return a report on a log: rate, gaps, bad values, saturation, quantization, units.

    `path`, `columns` (a map) and `max_bytes` are as in `read_log`. If the file or the map cannot be used at
    all, the report has that one error; no LogError is raised. Raises InputError for a `max_bytes` that is not
    a whole number from 1.
    """
    path = Path(path)
    try:
        found = gather(path, columns, max_bytes=max_bytes)
    except LogError as error:
        return LogReport(path, (Finding("error", "file", str(error)),))
    grid = grid_of(found)
    findings = [*found.findings, *check_axes(found, None), *check_lengths(found)]
    findings += [*grid.findings, *check_finite(found)]
    rate = None if grid.sample_time_s is None else 1.0 / grid.sample_time_s
    if rate is not None and all(finding.severity != "error" for finding in grid.findings):
        seconds = grid.n_samples / rate
        findings.append(Finding("ok", "rate", f"uniform at {rate:.6g} Hz for {seconds:.6g} s"))
    findings += [Finding("ok", "time", note) for note in grid.notes]
    findings += [Finding("warning", "map", note) for note in found.notes]
    findings += _without_torque(found)
    findings += _currents(found)
    why = "not a native column, not used" if found.pattern is None else "not used by the map"
    findings += [Finding("ok", short(name, 200), why) for name in found.unused]
    findings += look_at_signals(found.signals, found.labels, _prismatic(found))
    findings += _look_at_accelerations(found)
    sound = all(finding.severity != "error" for finding in findings)
    if sound and rate is not None and grid.stamps_s is None:
        findings += check_rows(found.signals, found.labels, 1.0 / rate)
    elif sound and grid.stamps_s is not None:
        findings += check_recorded(recorded_rows(grid.stamps_s, found.signals, found.labels))
    if rate is not None and grid.stamps_s is None:
        findings += _look_at_units(found, 1.0 / rate)
    return LogReport(path, tuple(findings), rate, grid.n_samples, len(found.columns.axis))


def _without_torque(found: Gathered) -> list[Finding]:
    """Return a finding on what a diagnosis needs if only positions and their targets were logged."""
    axes = found.columns.axis
    if any(x.torque is not None or x.position_ref is None for x in axes):
        return []
    message = (
        "none: a diagnosis compares positions under the same targets, with a robot that is told positions: an "
        "MJCF with <position> actuators, or a controller pd_position or cascade_position in the drive data; torque "
        "sensors and constants do not show"
    )
    return [Finding("ok", "torque", message)]


def _currents(found: Gathered) -> list[Finding]:
    """Return findings on what a diagnosis or the reader needs for currents without a scale."""
    known = "a current without a scale: read with a robot that states its torque constant; figures here are in A"
    unknown = (
        "a current whose torque constant nobody knows: a diagnosis finds it; figures here are in A"
    )
    return [
        Finding(
            "warning", found.labels["torque", axis], unknown if axis in found.unknown else known
        )
        for axis in sorted(found.currents)
    ]


def _usable(values: Floats | None) -> bool:
    return values is not None and values.size > 0 and bool(np.isfinite(values).all())


def _prismatic(found: Gathered) -> list[bool]:
    return [axis.prismatic for axis in found.columns.axis]


def look_at_signals(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], prismatic: Sequence[bool]
) -> list[Finding]:
    """Return findings about each signal (n,) on its own: constant, saturated, quantized.

    Field and axis (from 0) are the keys of `signals` (SI units) and `labels`. `prismatic` has one entry per
    axis.
    """
    findings = []
    for channel, values in signals.items():
        field, axis = channel
        unit = _UNITS[field][int(prismatic[axis])]
        finite = values[np.isfinite(values)]  # gaps and NaN are reported separately
        if finite.size:
            findings += check_signal(field, labels[channel], finite, unit, axis + 1)
    return findings


def _look_at_accelerations(found: Gathered) -> list[Finding]:
    """Return findings about each reading of an accelerometer on its own: constant, quantized."""
    findings = []
    for place, values in found.accelerations.items():
        finite = values[np.isfinite(values)]
        if finite.size:
            label = found.reading_labels[place]
            findings += check_signal("acceleration", label, finite, "m/s^2")
    return findings


def _look_at_units(found: Gathered, sample_time_s: float) -> list[Finding]:
    """Return findings on units from the position and the velocity (measured, else reference) of each axis."""
    findings = []
    for axis, columns in enumerate(found.columns.axis):
        position = found.signals.get(("position", axis))
        if position is None or not _usable(position):
            continue
        field = "velocity" if ("velocity", axis) in found.signals else "velocity_ref"
        velocity = found.signals.get((field, axis))
        if not _usable(velocity) or (velocity is not None and velocity.size != position.size):
            velocity = None
        label = found.labels.get((field, axis), found.labels[("position", axis)])
        findings += check_units(
            position, velocity, label, sample_time_s, prismatic=columns.prismatic
        )
    return findings
