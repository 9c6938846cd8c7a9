"""Check a single signal: constant, saturated, coarsely quantized."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from axisight.logs.findings import Finding, Severity
from axisight.logs.log import Floats

SATURATED_SAMPLES = 5
"""Consecutive samples at the extreme that count as one saturation."""
SATURATED_RUNS = 2
"""Saturations at the same extreme from which on a signal counts as saturated."""
COARSE_LEVELS = 256
"""A signal with fewer levels over its range counts as coarse."""


@dataclass(frozen=True)
class Quantization:
    """Estimated step, in the signal's SI unit, and log2 of the number of levels in its range (bits)."""

    step: float
    bits: float


def is_constant(values: Floats) -> bool:
    """Return whether all values (n,) are equal; False without any."""
    return values.size > 0 and bool(np.ptp(values) == 0.0)


def saturation_runs(values: Floats) -> tuple[int, int]:
    """Return the numbers of runs of at least 5 samples at the minimum and at the maximum of `values` (n,)."""
    return _runs(values == values.min()), _runs(values == values.max())


def _runs(mask: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return int(((edges[1::2] - edges[::2]) >= SATURATED_SAMPLES).sum())


def quantization(values: Floats) -> Quantization | None:
    """Return the step of quantized `values` (n,); None if they look continuous.

    The step is the smallest distance between distinct values, if the other distances are whole
    multiples of it.
    """
    levels = np.unique(values)
    if levels.size < 3:
        return None
    span = float(levels[-1] - levels[0])
    distances = np.diff(levels)
    distances = distances[distances > 1e-9 * max(span, float(np.abs(levels).max()))]
    if distances.size < 2:
        return None
    step = float(distances.min())
    counts = np.rint(distances / step)
    step = float(distances.sum() / counts.sum())
    off = np.abs(distances / step - np.rint(distances / step))
    if np.mean(off < 0.1) < 0.95:
        return None
    return Quantization(step=step, bits=math.log2(span / step + 1.0))


def check_signal(
    field: str, label: str, values: Floats, unit: str, axis: int | None = None
) -> list[Finding]:
    """Return findings about one finite signal `values` (n,) in SI `unit`, of an `axis` from 1.

    Only torques (`field`) are checked for saturation, because positions rest at their extremes and references
    stay there on purpose.
    """
    if is_constant(values):
        message = f"constant at {values[0]:.6g} {unit} over all {values.size} samples"
        severity: Severity = "ok" if field == "temperature" else "warning"
        return [Finding(severity, label, message, "channel_constant", axis)]
    findings = []
    if field == "torque":
        for name, runs, extreme in zip(
            ("minimum", "maximum"),
            saturation_runs(values),
            (float(values.min()), float(values.max())),
            strict=True,
        ):
            if runs >= SATURATED_RUNS and extreme != 0.0:
                message = (
                    f"saturates: {runs} times at least {SATURATED_SAMPLES} samples at its {name} "
                    f"{extreme:.6g} {unit}"
                )
                findings.append(Finding("warning", label, message, "torque_saturated", axis))
    found = quantization(values)
    if found is not None:
        coarse = 2.0**found.bits < COARSE_LEVELS and field != "temperature"
        message = (
            f"quantized in steps of {found.step:.4g} {unit} ({found.bits:.1f} bits over its range)"
        )
        name = f"quantized_{field}" if coarse else ""
        findings.append(Finding("warning" if coarse else "ok", label, message, name, axis))
    return findings
