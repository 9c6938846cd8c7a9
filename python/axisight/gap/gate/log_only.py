"""Checks one log alone, as ``axisight check`` does, after it has been read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding, GateSeverity
from axisight.logs import Finding as LogFinding
from axisight.logs import Log
from axisight.logs.checking import look_at_signals
from axisight.logs.grid import make_grid
from axisight.logs.jumps import check_jumps
from axisight.logs.native import NATIVE_STEMS
from axisight.logs.rows import check_recorded, check_rows
from axisight.logs.unit_guess import check_units
from axisight.logs.validate import not_finite
from axisight.records.clipping import clipped_samples

Array = NDArray[np.float64]
Channel = tuple[str, int]

# Attribute of a log for each field. The optional ones may be NaN on axes without the sensor.
_REQUIRED = {"position": "position_rad", "torque": "torque_nm"}
_REFERENCE = {"velocity_ref": "velocity_ref_rad_s"}
_OPTIONAL = {"velocity": "velocity_rad_s"}
# Travel of a reference [rad, or m] from which a constant channel is dead, not at rest. It is 1000 times the
# noise of a usual motor sensor.
_TRAVEL = 0.01
_LIMIT = ", or the drive stays at its limit and cannot hold the arm"


def moves(log: Log) -> NDArray[np.bool_]:
    """Return which axes (n_axes,) travel so far that a constant torque is dead, not at rest."""
    return np.asarray(np.ptp(log.position_rad, axis=0) > _TRAVEL)


def channels(log: Log) -> tuple[dict[Channel, Array], dict[Channel, str]]:
    """Return the signals (n,) of a log by field and axis (from 0), and the names of their columns."""
    signals: dict[Channel, Array] = {}
    for field, attribute in {**_REQUIRED, **_REFERENCE, **_OPTIONAL}.items():
        values = getattr(log, attribute)
        for axis in range(log.n_axes if values is not None else 0):
            column = np.asarray(values[:, axis])
            if field not in _OPTIONAL or np.isfinite(column).all():
                signals[field, axis] = column
    labels = {(field, axis): f"{NATIVE_STEMS[field][0]}_{axis + 1}" for field, axis in signals}
    return signals, labels


def check_log_alone(log: Log) -> list[Finding]:
    """Return findings about time stamps, bad values, rows, limits and dead channels of a log."""
    grid = make_grid(log.time_s, 1.0 / log.sample_time_s, log.n_samples, label="time_s")
    signals, labels = channels(log)
    wrong = [*grid.findings]
    for channel, values in signals.items():
        wrong += [
            _reference_missing(f, values)
            for f in not_finite(values, labels[channel], channel[1] + 1)
        ]
    if any(finding.severity == "error" for finding in wrong):
        return [named(finding, log) for finding in wrong]
    slides = [kind == "prismatic" for kind in log.axis_kinds]
    # References are chosen, not measured: they may be constant or have few levels.
    measured = {c: x for c, x in signals.items() if c[0] not in _REFERENCE}
    looked = look_at_signals(measured, labels, slides)
    if log.recorded is not None:
        looked += check_recorded(log.recorded)
    elif not log.is_resampled:  # interpolation causes steps and rests of its own
        looked += check_rows(measured, labels, log.sample_time_s)
    looked += _targets(log)
    out = [named(f, log) for f in looked if f.severity != "ok" and f.name]
    return [
        *(_dead(finding, log) for finding in out),
        *_clipped(log, labels),
        *_velocity(log, slides),
    ]


def _targets(log: Log) -> list[LogFinding]:
    """Return findings about targets of positions that no motion generator makes: wrapped turns, single samples off.

    Targets may rest, step and repeat; they are chosen.
    """
    targets = log.position_ref_rad
    if targets is None or not np.isfinite(targets).all():
        return []
    signals = {("position", axis): np.asarray(targets[:, axis]) for axis in range(log.n_axes)}
    labels = {channel: f"position_ref_{channel[1] + 1}" for channel in signals}
    found = check_jumps(signals, labels, log.sample_time_s)
    return [f for f in found if f.name in ("position_spike", "position_wrapped")]


def named(finding: LogFinding, log: Log) -> Finding:
    """Return a log's finding as one of the gate; an error becomes a refusal."""
    severity: GateSeverity = "refuse" if finding.severity == "error" else "flag"
    name = finding.name or "not_finite"
    return Finding(name, severity, finding.message, log.name, finding.axis, finding.column)


def _reference_missing(finding: LogFinding, values: Array) -> LogFinding:
    """Return the finding *reference missing* for a reference that is NaN throughout; other findings unchanged."""
    if not finding.column.startswith("velocity_ref") or not np.isnan(values).all():
        return finding
    message = (
        "expected a velocity reference for all axes or for none, got NaN only. Write the reference of the axis; "
        "zero if it rests"
    )
    return LogFinding("error", finding.column, message, "reference_missing", finding.axis)


def _dead(finding: Finding, log: Log) -> Finding:
    """Turn a constant channel into a refusal if its axis moves or has a moving reference."""
    if finding.name != "channel_constant" or finding.axis is None:
        return finding
    axis = finding.axis - 1
    travel = 0.0
    if finding.field.startswith("torque"):
        travel = float(np.ptp(log.position_rad[:, axis]))
    elif finding.field.startswith("position") and log.velocity_ref_rad_s is not None:
        path = np.cumsum(log.velocity_ref_rad_s[:, axis]) * log.sample_time_s
        travel = float(np.ptp(path))
    if travel <= _TRAVEL:
        return finding
    at_limit = finding.field.startswith("torque") and bool(np.any(log.torque_nm[:, axis]))
    message = (
        f"expected a signal, got one that is {finding.message} while the axis travels {travel:.4g} rad. The "
        f"channel is dead or was not recorded{_LIMIT if at_limit else ''}. Record it again, or leave the log out"
    )
    return Finding(finding.name, "refuse", message, log.name, finding.axis, finding.field)


def _clipped(log: Log, labels: dict[Channel, str]) -> list[Finding]:
    out = []
    for axis in range(log.n_axes):
        count = clipped_samples(np.ascontiguousarray(log.position_rad[:, axis]))
        if count:
            message = (
                f"expected a motion, got {count} samples cut at the largest or smallest position, while the axis "
                "moved towards it. Check the range of the sensor and the end stops"
            )
            column = labels["position", axis]
            out.append(Finding("position_clipped", "flag", message, log.name, axis + 1, column))
    return out


def _velocity(log: Log, slides: list[bool]) -> list[Finding]:
    """Flag a measured velocity that is not the derivative of the position; the position is used instead."""
    out = []
    measured = log.velocity_rad_s
    for axis in range(log.n_axes if measured is not None else 0):
        velocity = measured[:, axis] if measured is not None else None
        if velocity is None or not np.isfinite(velocity).all():
            continue
        column = f"{NATIVE_STEMS['velocity'][0]}_{axis + 1}"
        position = np.ascontiguousarray(log.position_rad[:, axis])
        for finding in check_units(
            position,
            np.ascontiguousarray(velocity),
            column,
            log.sample_time_s,
            prismatic=slides[axis],
        ):
            if finding.severity != "ok" and finding.column == column:
                message = f"{finding.message}. The motion is taken from the position instead"
                out.append(
                    Finding("velocity_inconsistent", "flag", message, log.name, axis + 1, column)
                )
    return out
