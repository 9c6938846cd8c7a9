"""The column map of a recording of ROS: which topic has position and effort of a robot's joints."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.columns import ColumnMap

if TYPE_CHECKING:
    from axisight.robot import Robot

_REQUIRED = ("position", "effort")


def joint_state_map(
    arrays: Mapping[str, NDArray[Any]], robot: Robot | None, where: Path
) -> ColumnMap:
    """Return the column map of the topic that has position and effort of joints, joint side.

    Axes stand in the order of ``robot``, found by the names of its joints, or as the topic has them without
    one. Stamps that are not uniform are resampled at their usual rate, which the log's notes say. Raises
    LogError where no topic, or more than one, has what is needed.
    """
    topics = _topics(arrays)
    wanted = None if robot is None else robot.axis_names
    usable = {
        t: joints for t, joints in topics.items() if wanted is None or set(wanted) <= set(joints)
    }
    if len(usable) != 1:
        shown = "; ".join(f"{t}: {', '.join(joints)}" for t, joints in topics.items()) or "none"
        joints = "joints" if wanted is None else ", ".join(wanted)
        raise LogError(
            f"{where}: expected one topic with position and effort of {joints}, got "
            f"{'several' if len(usable) > 1 else 'none'} (topics that have both: {shown}); name the joints "
            f"of the model as the recording does, or give a column map"
        )
    ((topic, found),) = usable.items()
    slides = [False] * len(found) if robot is None else robot.axis_is_prismatic
    axes = [
        _axis(arrays, topic, joint, prismatic)
        for joint, prismatic in zip(wanted or found, slides, strict=True)
    ]
    time = {"name": f"{topic}.time_s", "unit": "s", "resample_hz": "mean"}
    return ColumnMap.model_validate({"time": time, "axis": axes, "side": "joint"})


def _topics(arrays: Mapping[str, NDArray[Any]]) -> dict[str, list[str]]:
    """Return the joints of every topic that has position and effort of some."""
    out: dict[str, list[str]] = {}
    for name in arrays:
        topic, mark, joint = name.partition(".position.")
        if mark and all(f"{topic}.{field}.{joint}" in arrays for field in _REQUIRED):
            out.setdefault(topic, []).append(joint)
    return out


def _axis(
    arrays: Mapping[str, NDArray[Any]], topic: str, joint: str, prismatic: bool
) -> dict[str, Any]:
    units = ("m", "N", "m/s") if prismatic else ("rad", "Nm", "rad/s")
    fields = zip(
        ("position", "torque", "velocity"), ("position", "effort", "velocity"), units, strict=True
    )
    return {
        key: {"name": f"{topic}.{field}.{joint}", "unit": unit}
        for key, field, unit in fields
        if f"{topic}.{field}.{joint}" in arrays
    }
