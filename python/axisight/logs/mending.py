"""The line of a column map or a robot file that mends a fault, where one does."""

from __future__ import annotations

# What to add to the channel of an axis in a column map.
_CHANNEL = {
    "position_in_degrees": 'unit = "deg"',
    "position_in_revolutions": 'unit = "rev"',
    "position_in_counts": 'unit = "counts", counts_per_rev = N',
    "position_in_mrad": "scale = 0.001",
    "velocity_ref_in_deg_s": 'unit = "deg/s"',
    "velocity_ref_in_rpm": 'unit = "rpm"',
    "velocity_ref_in_rev_s": 'unit = "rev/s"',
    "velocity_ref_in_mrad_s": "scale = 0.001",
    "torque_in_mnm": "scale = 0.001",
    "torque_in_knm": "scale = 1000",
    "sign_flipped": "sign = -1",
}
# Whole lines, and where they belong.
_LINE = {
    "position_joint_side": 'column map: side = "joint"',
    "velocity_ref_joint_side": 'column map: side = "joint"',
    "torque_joint_side": 'column map: side = "joint"',
    "gravity_flipped": "robot file: gravity with the other sign",
    "torque_without_gravity": "robot file: gravity = [0.0, 0.0, 0.0]",
    "time_in_ms": 'column map, time: unit = "ms"',
    "time_in_us": 'column map, time: unit = "us"',
}
# Name of a channel in a column map by the stem of its native column.
_STEMS = {"torque_cmd": "torque", "position": "position", "velocity_ref": "velocity_ref"}


def mending_line(name: str, axis: int | None, field: str) -> str | None:
    """Return the line that mends the fault ``name`` of an ``axis`` (from 1, None for all) and a ``field``.

    ``field`` as in `Finding`. None where no single line does.
    """
    if name in _LINE:
        return _LINE[name]
    stem = field.rstrip("0123456789").rstrip("_")
    if name not in _CHANNEL or stem not in _STEMS:
        return None
    where = "every axis" if axis is None else f"axis {axis}"
    return f"column map, {where}: {_STEMS[stem]} = {{ ..., {_CHANNEL[name]} }}"
