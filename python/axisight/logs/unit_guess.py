"""Find wrong units by comparing a velocity with the differentiated position."""

from __future__ import annotations

import math

import numpy as np

from axisight.errors import InputError
from axisight.logs.filters import differentiate, lowpass
from axisight.logs.findings import Finding
from axisight.logs.log import Floats

_BAND_HZ = 20.0
_ALIKE = 0.95
_EXACT = 0.03
_FASTEST_RAD_S = 3000.0

# Ratio of velocity to differentiated position -> meaning of that ratio
_MEANINGS = {
    180.0 / math.pi: "velocity in deg/s, position in rad",
    math.pi / 180.0: "velocity in rad/s, position in deg",
    30.0 / math.pi: "velocity in rpm, position in rad",
    1.0 / 6.0: "velocity in rpm, position in deg",
    2.0 * math.pi: "velocity in rad/s, position in revolutions",
    0.5 / math.pi: "velocity in rev/s, position in rad",
    360.0: "velocity in deg/s, position in revolutions",
    60.0: "velocity in rpm, position in revolutions",
    1000.0: "velocity in mm/s, position in m",
    0.001: "velocity in m/s, position in mm",
}


def velocity_ratio(position: Floats, velocity: Floats, sample_time_s: float) -> tuple[float, float]:
    """Return (ratio, correlation) of `velocity` (n,) to the derivative of `position` (n,).

    Both are compared below 20 Hz, or a fifth of the sample rate if that is less. A ratio of 1
    means equal units. If one of the two does not move, the correlation is 0 and the ratio NaN. Raises
    InputError like `differentiate`.
    """
    cutoff_hz = min(_BAND_HZ, 0.2 / sample_time_s)
    derived, _ = differentiate(position, sample_time_s, cutoff_hz)
    given = lowpass(velocity, sample_time_s, cutoff_hz)
    power = float(derived @ derived)
    given_power = float(given @ given)
    if power == 0.0 or given_power == 0.0:
        return math.nan, 0.0
    product = float(derived @ given)
    return product / power, product / math.sqrt(power * given_power)


def check_units(
    position: Floats, velocity: Floats | None, label: str, sample_time_s: float, *, prismatic: bool
) -> list[Finding]:
    """Return findings about the units of finite `position` (n,) and `velocity` (n,) or None."""
    findings = []
    try:
        if not prismatic:
            fast, _ = differentiate(position, sample_time_s, min(_BAND_HZ, 0.2 / sample_time_s))
            peak = float(np.abs(fast).max())
            if peak > _FASTEST_RAD_S:
                message = (
                    f"expected a motor position in rad, got up to {peak:.3g} rad/s: counts or deg?"
                )
                findings.append(Finding("warning", "position", message))
        if velocity is None:
            return findings
        ratio, alike = velocity_ratio(position, velocity, sample_time_s)
    except InputError as error:
        return [Finding("warning", label, f"units not compared: {error}")]
    if abs(alike) < _ALIKE:
        if alike != 0.0:
            message = f"does not follow the differentiated position (correlation {alike:.2f})"
            findings.append(Finding("warning", label, message))
    elif ratio < 0.0:
        message = (
            f"runs against the differentiated position (ratio {ratio:.4g}): sign of one is wrong"
        )
        findings.append(Finding("error", label, message))
    elif abs(ratio - 1.0) <= 0.2:
        message = f"agrees with the differentiated position (ratio {ratio:.4g})"
        findings.append(Finding("ok", label, message))
    else:
        findings.append(_explain(ratio, label))
    return findings


def _explain(ratio: float, label: str) -> Finding:
    for known, meaning in _MEANINGS.items():
        if abs(ratio / known - 1.0) <= _EXACT:
            message = (
                f"expected ratio 1 to the differentiated position, got {ratio:.4g}: {meaning}?"
            )
            return Finding("error", label, message)
    message = (
        f"expected ratio 1 to the differentiated position, got {ratio:.4g}: gear ratio or unit?"
    )
    return Finding("warning", label, message)
