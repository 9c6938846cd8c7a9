"""The column map of a ROS recording: the topic with positions and efforts of a robot's joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.columns import ColumnMap

if TYPE_CHECKING:
    from axisight.robot import Robot

# Signal of an axis -> field of a topic; the first two of a layout are required. The layouts are joint states,
# and the states of trajectory controllers with newer and older field names.
_LAYOUTS: tuple[dict[str, str], ...] = (
    {"position": "position", "torque": "effort", "velocity": "velocity"},
    *(
        {
            "position": f"{done}.positions",
            "position_ref": f"{told}.positions",
            "velocity": f"{done}.velocities",
            "velocity_ref": f"{told}.velocities",
            "torque": f"{done}.effort",
        }
        for done, told in (("feedback", "reference"), ("actual", "desired"))
    ),
)
_UNITS = {
    "position": ("rad", "m"),
    "position_ref": ("rad", "m"),
    "velocity": ("rad/s", "m/s"),
    "velocity_ref": ("rad/s", "m/s"),
    "torque": ("Nm", "N"),
}


def joint_state_map(
    arrays: Mapping[str, NDArray[Any]],
    robot: Robot | None,
    where: Path,
    left_out: Sequence[str] = (),
) -> ColumnMap:
    """Return the joint-side column map of the topic with positions and efforts, or positions and targets.

    ``arrays`` are the columns of the recording ``where``. Axes are in the order of the joints of ``robot``,
    or without a robot in that of the topic. If no topic has efforts, or only such as are zero or NaN
    throughout, the states of trajectory controllers are searched for position targets. Irregular stamps are
    resampled at their mean rate. The log's notes say both.

    Raises LogError unless exactly one topic has all required fields of all joints. The message includes
    ``left_out``, the reasons for topics that were not read.
    """
    wanted = None if robot is None else robot.axis_names
    shown_topics: list[str] = []
    choices: list[tuple[dict[str, str], dict[str, list[str]]]] = []
    for layout in _LAYOUTS:
        topics = _topics(arrays, layout)
        shown_topics += [f"{t}: {', '.join(joints)}" for t, joints in topics.items()]
        usable = {
            t: joints
            for t, joints in topics.items()
            if wanted is None or set(wanted) <= set(joints)
        }
        if usable:
            choices.append((layout, usable))
    layout, usable = choices[0] if choices else (_LAYOUTS[0], {})
    note = None
    if layout is _LAYOUTS[0] and len(choices) > 1 and _is_unfilled(arrays, usable):
        note = f"efforts of {', '.join(usable)} are zero or NaN throughout and count as not logged"
        layout, usable = choices[1]
    if len(usable) != 1:
        shown = "; ".join(shown_topics) or "none"
        joints = "joints" if wanted is None else ", ".join(wanted)
        besides = "".join(f"; {said}" for said in left_out)
        raise LogError(
            f"{where}: expected one topic with position and effort of {joints}, or with targets of their "
            f"positions, got {'several' if len(usable) > 1 else 'none'} (topics that have both: {shown}); name the "
            f"joints of the model as the recording does, or give a column map{besides}"
        )
    ((topic, found),) = usable.items()
    slides = [False] * len(found) if robot is None else robot.axis_is_prismatic
    axes = [
        _axis(arrays, topic, joint, layout, slides=prismatic)
        for joint, prismatic in zip(wanted or found, slides, strict=True)
    ]
    time = {"name": f"{topic}.time_s", "unit": "s", "resample_hz": "mean", "note": note}
    return ColumnMap.model_validate({"time": time, "axis": axes, "side": "joint"})


def _topics(arrays: Mapping[str, NDArray[Any]], layout: Mapping[str, str]) -> dict[str, list[str]]:
    """Return, by topic, the joints that have the two required fields of a layout."""
    first, second, *_ = layout.values()
    out: dict[str, list[str]] = {}
    for name in arrays:
        topic, mark, joint = name.partition(f".{first}.")
        if mark and f"{topic}.{second}.{joint}" in arrays:
            out.setdefault(topic, []).append(joint)
    return out


def _is_unfilled(arrays: Mapping[str, NDArray[Any]], topics: Mapping[str, list[str]]) -> bool:
    """Whether the efforts of joint states are zero or NaN throughout; False if one cannot be read."""
    names = [f"{topic}.effort.{joint}" for topic, joints in topics.items() for joint in joints]
    try:
        return not any(np.nan_to_num(arrays[name]).any() for name in names)
    except LogError:
        return False


def _axis(
    arrays: Mapping[str, NDArray[Any]],
    topic: str,
    joint: str,
    layout: Mapping[str, str],
    *,
    slides: bool,
) -> dict[str, Any]:
    return {
        key: {"name": f"{topic}.{field}.{joint}", "unit": _UNITS[key][slides]}
        for key, field in layout.items()
        if f"{topic}.{field}.{joint}" in arrays
    }
