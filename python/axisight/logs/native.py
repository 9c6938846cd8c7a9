"""The native column names of `axisight.case/1`, expressed as a column map."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

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
_PATTERN = re.compile(
    r"^(" + "|".join(stem for stem, _ in NATIVE_STEMS.values()) + r")_([1-9]\d*)$"
)


def native_map(names: Iterable[str], where: str) -> ColumnMap:
    """Return the column map of a file whose columns bear the native `names`.

    The number of axes is the highest axis number that any native column has, so that a missing
    column of a middle axis is found. Raises LogError, naming the file `where`, when no native
    column is there at all.
    """
    present = set(names)
    numbers = [int(match.group(2)) for name in present if (match := _PATTERN.match(name))]
    if not numbers:
        listed = ", ".join(sorted(present)[:8]) or "nothing"
        raise LogError(
            f"{where}: position_1: expected the native columns time_s, position_1, torque_cmd_1, "
            f"... or a column map, got {listed}"
        )
    stems = {match.group(1) for name in present if (match := _PATTERN.match(name))}
    # Targets of positions stand in for torques where there are none at all.
    required = {"position", "torque"}
    if "position_ref" in stems and "torque_cmd" not in stems:
        required = {"position", "position_ref"}
    axes = []
    for number in range(1, max(numbers) + 1):
        axis: dict[str, Any] = {}
        for field, (stem, unit) in NATIVE_STEMS.items():
            name = f"{stem}_{number}"
            if field in required or name in present:
                axis[field] = {"name": name, "unit": unit}
        axes.append(axis)
    return ColumnMap.model_validate({"time": {"name": "time_s", "unit": "s"}, "axis": axes})
