"""The native column names of `axisight.case/1`, expressed as a column map."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from axisight.arguments import short
from axisight.errors import LogError
from axisight.logs.columns import ColumnMap

# Field of an axis -> (native column stem, unit)
NATIVE_STEMS = {
    "position": ("position", "rad"),
    "torque": ("torque_cmd", "Nm"),
    "position_ref": ("position_ref", "rad"),
    "velocity_ref": ("velocity_ref", "rad/s"),
    "velocity": ("velocity", "rad/s"),
    "joint_position": ("joint_position", "rad"),
    "temperature": ("temperature_c", "degC"),
}
# Sensor and direction of a column of an accelerometer.
ACCELERATION = re.compile(r"^acceleration_([A-Za-z][A-Za-z0-9_]*)_([xyz])$")
# A message lists at most this many columns with other names.
_SHOWN = 12
_PATTERN = re.compile(
    r"^(" + "|".join(stem for stem, _ in NATIVE_STEMS.values()) + r")_([1-9][0-9]*)$"
)


def native_map(names: Iterable[str], where: str) -> ColumnMap:
    """Return the column map of a file whose columns have the native `names`.

    The number of axes is the highest axis number of any native column. Raises LogError, naming the
    file `where`, if there is no native column at all, or none of an axis below the highest.
    """
    present = set(names)
    matches = [match for name in present if (match := _PATTERN.match(name))]
    # Nine digits exceed the axes of any file, and keep huge numbers in names from costing time.
    numbers = {int(match.group(2)[:9]): match.group(0) for match in matches}
    if not numbers:
        listed = ", ".join(map(short, sorted(present)[:_SHOWN])) or "nothing"
        more = ", ..." if len(present) > _SHOWN else ""
        raise LogError(
            f"{where}: position_1: expected columns time_s, position_1, torque_cmd_1 (or position_ref_1), "
            f"and so on for each axis, or a column map in --columns, got {listed}{more} "
            f"({len(present)} columns); `axisight columns guess LOG --robot MODEL -o columns.toml` proposes "
            "a map"
        )
    highest = max(numbers)
    if highest > len(numbers):
        missing = next(k for k in range(1, highest) if k not in numbers)
        raise LogError(
            f"{where}: position_{missing}: expected columns of axes 1 to {highest} (the highest is "
            f"{short(numbers[highest])}), got none of axis {missing}"
        )
    stems = {match.group(1) for match in matches}
    # Without any torque, targets of positions are required instead.
    required = {"position", "torque"}
    if "position_ref" in stems and "torque_cmd" not in stems:
        required = {"position", "position_ref"}
    axes = []
    for number in range(1, highest + 1):
        axis: dict[str, Any] = {}
        for field, (stem, unit) in NATIVE_STEMS.items():
            name = f"{stem}_{number}"
            if field in required or name in present:
                axis[field] = {"name": name, "unit": unit}
        axes.append(axis)
    return ColumnMap.model_validate(
        {
            "time": {"name": "time_s", "unit": "s"},
            "axis": axes,
            "accelerometer": _accelerometers(present),
        }
    )


def _accelerometers(names: Iterable[str]) -> list[dict[str, Any]]:
    """Return the accelerometers whose native columns are among ``names``, by name."""
    found: dict[str, dict[str, Any]] = {}
    for column in sorted(names):
        match = ACCELERATION.match(column)
        if match is not None:
            sensor = found.setdefault(match[1], {"name": match[1]})
            sensor[match[2]] = {"name": column, "unit": "m/s^2"}
    return list(found.values())
