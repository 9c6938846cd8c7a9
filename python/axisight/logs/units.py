"""The units that a column map may name, and their factors to SI."""

from __future__ import annotations

import math
from typing import Literal

from axisight.errors import LogError

TimeUnit = Literal["s", "ms", "us", "ns"]
PositionUnit = Literal["rad", "deg", "rev", "counts", "m", "mm"]
VelocityUnit = Literal["rad/s", "deg/s", "rpm", "rev/s", "counts/s", "m/s", "mm/s"]
TorqueUnit = Literal["Nm", "N", "A", "V"]
AccelerationUnit = Literal["m/s^2", "mm/s^2", "g"]
TemperatureUnit = Literal["degC", "K"]

POSITION_UNITS = ("rad", "deg", "rev", "m", "mm")
"""Units of positions that a name alone can state; counts also need `counts_per_rev`."""
PRISMATIC_UNITS = frozenset({"m", "mm", "m/s", "mm/s", "N"})
"""Units that only a prismatic axis has."""
REVOLUTE_UNITS = frozenset(
    {"rad", "deg", "rev", "counts", "rad/s", "deg/s", "rpm", "rev/s", "counts/s", "Nm"}
)
"""Units that only a revolute axis has."""

_TURN = 2.0 * math.pi
_FACTORS = {
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
    "rad": 1.0,
    "deg": math.pi / 180.0,
    "rev": _TURN,
    "m": 1.0,
    "mm": 1e-3,
    "rad/s": 1.0,
    "deg/s": math.pi / 180.0,
    "rpm": _TURN / 60.0,
    "rev/s": _TURN,
    "m/s": 1.0,
    "mm/s": 1e-3,
    "m/s^2": 1.0,
    "mm/s^2": 1e-3,
    "g": 9.80665,  # standard gravity
    "Nm": 1.0,
    "N": 1.0,
    "A": 1.0,  # the map's scale carries Nm/A or N/A
    "V": 1.0,
    "degC": 1.0,
    "K": 1.0,
}


def si_factor(unit: str, counts_per_rev: float | None = None) -> float:
    """Return the factor that turns a value in `unit` into SI (rad, m, rad/s, m/s, m/s^2, s, Nm, N).

    Raises LogError for an unknown unit, or for counts without `counts_per_rev`.
    """
    if unit in {"counts", "counts/s"}:
        if counts_per_rev is None:
            raise LogError(f"counts_per_rev: expected a number for unit {unit!r}, got nothing")
        return _TURN / counts_per_rev
    if unit not in _FACTORS:
        raise LogError(f"unit: expected one of {', '.join(sorted(_FACTORS))}, got {unit!r}")
    return _FACTORS[unit]


def si_offset(unit: str) -> float:
    """Return the offset to add after scaling, -273.15 for K (to degC) and 0 for every other unit."""
    return -273.15 if unit == "K" else 0.0
