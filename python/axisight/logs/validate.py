"""What must hold before signals may become a Log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.errors import LogError
from axisight.logs.findings import Finding
from axisight.logs.gather import Gathered
from axisight.logs.grid import RATE_TOLERANCE
from axisight.logs.log import Log


def check_axes(found: Gathered, n_axes: int | None) -> list[Finding]:
    """Check the number of axes, and that a reference is there for all axes or for none."""
    findings = []
    got = len(found.columns.axis)
    if n_axes is not None and got != n_axes:
        findings.append(Finding("error", "axis", f"expected {n_axes} axes, got columns for {got}"))
    with_ref = [
        number for number, axis in enumerate(found.columns.axis, 1) if axis.velocity_ref is not None
    ]
    if with_ref and len(with_ref) != got:
        missing = sorted(set(range(1, got + 1)) - set(with_ref))
        findings.append(
            Finding(
                "error",
                f"velocity_ref_{missing[0]}",
                f"expected a velocity reference for all {got} axes or for none, got it for axes "
                f"{', '.join(map(str, with_ref))}",
            )
        )
    return findings


def check_lengths(found: Gathered) -> list[Finding]:
    """Check that every signal and the time column have as many samples as the first of them."""
    lengths = {found.labels[channel]: values.size for channel, values in found.signals.items()}
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
    """Check every signal for NaN and infinities."""
    findings = []
    for channel, values in found.signals.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            nan = int(np.isnan(values).sum())
            findings.append(
                Finding(
                    "error",
                    found.labels[channel],
                    f"expected finite values, got {nan} NaN and {bad.size - nan} inf among "
                    f"{values.size}, first at index {bad[0]}",
                )
            )
    return findings


def check_same_rate(logs: Sequence[Log]) -> None:
    """Raise LogError when the logs were not all sampled at the rate of the first."""
    for log in logs[1:]:
        if abs(log.sample_time_s / logs[0].sample_time_s - 1.0) > RATE_TOLERANCE:
            raise LogError(
                f"{log.source}: sample rate: expected {logs[0].sample_rate_hz:.6g} Hz as in "
                f"{logs[0].name}, got {log.sample_rate_hz:.6g} Hz"
            )
