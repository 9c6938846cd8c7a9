"""Gear ratios of a URDF: transmissions of ros_control, and those of ros2_control."""

from __future__ import annotations

from collections.abc import Container

import numpy as np

from axisight.arguments import shown
from axisight.errors import RobotError
from axisight.robot_import.xml_tree import Element

_CLASSIC, _ROS2 = "mechanicalReduction", "mechanical_reduction"


def gear_ratios(root: Element, joints: Container[str]) -> tuple[dict[str, float], list[str]]:
    """Return the gear ratio r of joints, one over their reduction, and what of transmissions is left out.

    ``joints``: names of all there are. Raises RobotError for a reduction that is none.
    """
    ratios: dict[str, float] = {}
    notes: list[str] = []
    holders = [root, *root.all("ros2_control")]
    for transmission in (one for holder in holders for one in holder.all("transmission")):
        driven = [joint.require("name", "a joint") for joint in transmission.all("joint")]
        called = f"transmission {transmission.attributes.get('name', '')!r}"
        if len(driven) > 1:
            # A differential or a linkage: no ratio of one axis.
            names = ", ".join(map(repr, driven))
            notes.append(f"{called} drives several joints, {names}: their reductions left out")
            continue
        reduction, ignored = _reduction(transmission)
        if ignored:
            notes.append(
                f"{called}: {_ROS2} of its actuator left out, ros2_control takes that of the joint"
            )
        if not driven or reduction is None:
            continue
        if driven[0] not in joints:
            notes.append(f"{called} is of a joint {driven[0]!r} that is not there: left out")
        elif ratios.setdefault(driven[0], 1.0 / reduction) != 1.0 / reduction:
            notes.append(
                f"{called}: reduction {reduction:g} of {driven[0]!r} left out, another transmission says "
                f"{1.0 / ratios[driven[0]]:g}"
            )
    return ratios, notes


def _reduction(transmission: Element) -> tuple[float | None, bool]:
    """Return the reduction of a transmission of one joint, None without any, and whether one has no effect."""
    actuators, joints = transmission.all("actuator"), transmission.all("joint")
    classic = [x for holder in (*actuators, *joints) for x in holder.all(_CLASSIC)]
    of_joint = [x for joint in joints for x in joint.all(_ROS2)]
    of_actuator = [x for actuator in actuators for x in actuator.all(_ROS2)]
    # ros2_control reads both and gears a simple transmission by that of its joint.
    ignored = any(_number(x) != 1.0 for x in of_actuator)
    found = [*of_joint, *classic]
    return (_number(found[0]) if found else None), ignored


def _number(element: Element) -> float:
    text = element.text.strip()
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if value == 0 or not np.isfinite(value):
        raise RobotError(
            f"{element.where}: expected a reduction other than zero, got {shown(text)}"
        )
    return value
