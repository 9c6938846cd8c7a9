"""Checks that signals must pass to become a Log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.errors import LogError
from axisight.logs.findings import Finding
from axisight.logs.gather import Gathered
from axisight.logs.grid import RATE_TOLERANCE
from axisight.logs.log import Floats, Log


def check_axes(found: Gathered, n_axes: int | None) -> list[Finding]:
    """Return findings about the number of axes, and about signals that only some axes have.

    Either all axes must have a torque, or all must have a target of the position. References must exist for
    all axes or for none.
    """
    findings = []
    got = len(found.columns.axis)
    if n_axes is not None and got != n_axes:
        findings.append(
            Finding(
                "error", "axis", f"expected {n_axes} axes, got columns for {got}", "axes_differ"
            )
        )
    if all(axis.torque is None for axis in found.columns.axis):
        findings += _no_torque(found)
    else:
        findings += _partly(found, "torque", "a torque", "torque_missing")
    findings += _partly(found, "velocity_ref", "a velocity reference", "reference_missing")
    return findings + _partly(
        found, "position_ref", "a target of the position", "reference_missing"
    )


def _no_torque(found: Gathered) -> list[Finding]:
    """Return a finding if a log without torque has no targets of positions either."""
    if any(axis.position_ref is not None for axis in found.columns.axis):
        return []
    looked_for = found.pattern.looked_for("torque") if found.pattern is not None else ""
    if found.pattern is None:
        more = (
            "; in a map of `axisight columns guess` what may be one stands as a comment, currents with a scale "
            'to be stated, or "unknown"'
        )
    else:
        more = f"; no column is called {looked_for}" if looked_for else ""
    message = (
        "expected a torque (or force, or current or voltage with its scale) of every axis, or targets of "
        f"positions, got neither{more}"
    )
    return [Finding("error", "torque_1", message, "torque_missing", 1)]


def _partly(found: Gathered, field: str, words: str, name: str) -> list[Finding]:
    """Return a finding if some axes have a signal and others do not."""
    axes = found.columns.axis
    having = [number for number, axis in enumerate(axes, 1) if getattr(axis, field) is not None]
    if not having or len(having) == len(axes):
        return []
    missing = min(set(range(1, len(axes) + 1)) - set(having))
    message = (
        f"expected {words} for all {len(axes)} axes or for none, got it for axes "
        f"{', '.join(map(str, having))}"
    )
    return [Finding("error", f"{field}_{missing}", message, name, missing)]


def check_lengths(found: Gathered) -> list[Finding]:
    """Return a finding for each signal whose length differs from that of the time, or of the first signal."""
    lengths = {label: values.size for label, values in found.all_signals.items()}
    if found.time_s is not None and found.columns.time is not None:
        lengths = {found.columns.time.label: found.time_s.size, **lengths}
    if not lengths:
        return []
    first, expected = next(iter(lengths.items()))
    return [
        Finding("error", label, f"expected {expected} samples as in {first}, got {size}")
        for label, size in lengths.items()
        if size != expected
    ]


def check_finite(found: Gathered) -> list[Finding]:
    """Return a finding for each signal with NaN or infinities."""
    findings = []
    for channel, values in found.signals.items():
        findings += not_finite(values, found.labels[channel], channel[1] + 1, found.time_s)
    for place, values in found.accelerations.items():
        findings += not_finite(values, found.reading_labels[place], None, found.time_s)
    return findings


def not_finite(
    values: Floats, label: str, axis: int | None, time_s: Floats | None = None
) -> list[Finding]:
    """Return a finding if `values` (n,), of an `axis` (from 1) unless None, hold NaN or infinities.

    `time_s` (n,) (s), if known, adds the time of the first one.
    """
    bad = np.flatnonzero(~np.isfinite(values))
    if not bad.size:
        return []
    nan = int(np.isnan(values).sum())
    first = bad[0]
    when = "" if time_s is None or first >= time_s.size else f", {time_s[first]:.9g} s"
    message = (
        f"expected finite values, got {nan} NaN and {bad.size - nan} inf among {values.size}, "
        f"first at index {first}{when}"
    )
    return [Finding("error", label, message, "not_finite", axis)]


def check_same_rate(logs: Sequence[Log]) -> None:
    """Raise LogError if the sample rate of a log differs from that of the first by more than 1e-4 of it."""
    for log in logs[1:]:
        if abs(log.sample_time_s / logs[0].sample_time_s - 1.0) > RATE_TOLERANCE:
            raise LogError(
                f"{log.source}: sample rate: expected {logs[0].sample_rate_hz:.6g} Hz as in "
                f"{logs[0].name}, got {log.sample_rate_hz:.6g} Hz{time_unit(log, logs[0])} "
                "[rates_differ]"
            )


def time_unit(log: Log, other: Log) -> str:
    """Return a question about the unit of time if sample times differ by a factor of 1e3 or 1e6, else ""."""
    for factor, unit in ((1e3, "ms"), (1e6, "us")):
        if abs(log.sample_time_s / other.sample_time_s / factor - 1.0) < 0.01:
            return f": time in {unit}?"
    return ""
