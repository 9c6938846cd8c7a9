"""Names the unit of a channel from the factor by which it is too large."""

from __future__ import annotations

import math

# Largest relative difference from a unit's factor: ratios of filtered signals are that exact, and no other unit
# is as near.
TOLERANCE = 0.04
# Degrees per radian.
_DEG = 180.0 / math.pi

# Factors of positions in other units than rad [1].
_POSITION = {
    "position_in_degrees": _DEG,
    "position_in_revolutions": 0.5 / math.pi,
    "position_in_mrad": 1000.0,
}
# Factors of speed references in other units than rad/s [1].
_VELOCITY_REF = {
    "velocity_ref_in_deg_s": _DEG,
    "velocity_ref_in_rpm": 30.0 / math.pi,
    "velocity_ref_in_rev_s": 0.5 / math.pi,
    "velocity_ref_in_mrad_s": 1000.0,
}
# Factors of torques in other units than Nm [1].
_TORQUE = {"torque_in_mnm": 1000.0, "torque_in_knm": 0.001}
# Fewest bits per motor turn in encoder catalogues.
_LEAST_COUNT_BITS = 8
# Most bits per motor turn in encoder catalogues.
_MOST_COUNT_BITS = 30


def scale_name(field: str, factor: float, gear_ratio: float) -> str:
    """Return the name of the fault of a channel that is ``factor`` times too large.

    ``field``: ``position``, ``velocity_ref`` or ``torque``; ``gear_ratio``: joint angle per motor angle of its
    axis. An unknown factor gives ``position_scaled`` and so on.
    """
    factor, ratio = abs(factor), abs(gear_ratio)
    tables = {"position": _POSITION, "velocity_ref": _VELOCITY_REF, "torque": _TORQUE}
    for name, known in tables[field].items():
        if abs(factor / known - 1.0) < TOLERANCE:
            return name
    joint_side = 1.0 / ratio if field == "torque" else ratio
    if abs(math.log(joint_side)) > 0.1 and abs(factor / joint_side - 1.0) < TOLERANCE:
        return f"{field}_joint_side"
    if field == "position" and _is_count(factor):
        return "position_in_counts"
    return f"{field}_scaled"


def _is_count(factor: float) -> bool:
    """Whether one turn has a power of two, or a whole number of thousands, of units."""
    per_turn = 2 * math.pi * factor
    bits = math.log2(per_turn) if per_turn > 0 else 0.0
    if not _LEAST_COUNT_BITS <= bits <= _MOST_COUNT_BITS:
        return False
    thousands = per_turn / 1000.0
    near = abs(thousands - round(thousands)) < 0.01 * thousands and thousands < 50
    return abs(2.0 ** (bits - round(bits)) - 1.0) < TOLERANCE / 2 or near
