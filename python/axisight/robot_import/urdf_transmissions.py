"""Read the gear ratios of a URDF from the transmissions of ros_control and ros2_control."""

from __future__ import annotations

from collections.abc import Container

import numpy as np

from axisight.arguments import shown
from axisight.errors import RobotError
from axisight.robot_import.xml_tree import Element

_CLASSIC, _ROS2 = "mechanicalReduction", "mechanical_reduction"


def gear_ratios(root: Element, joints: Container[str]) -> tuple[dict[str, float], list[str]]:
    """Return the gear ratio r (1 / reduction) by joint, and notes on transmissions that are left out.

    ``joints`` are the names of all joints. Raises RobotError for a reduction that is zero or not a number.
    """
    ratios: dict[str, float] = {}
    notes: list[str] = []
    holders = [root, *root.all("ros2_control")]
    for transmission in (one for holder in holders for one in holder.all("transmission")):
        driven = [joint.require("name", "a joint") for joint in transmission.all("joint")]
        called = f"transmission {transmission.attributes.get('name', '')!r}"
        if len(driven) > 1:
            # A differential or a linkage has no ratio for a single axis.
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
    """Return the reduction of a transmission, or None, and whether its actuator states one without effect."""
    actuators, joints = transmission.all("actuator"), transmission.all("joint")
    classic = [x for holder in (*actuators, *joints) for x in holder.all(_CLASSIC)]
    of_joint = [x for joint in joints for x in joint.all(_ROS2)]
    of_actuator = [x for actuator in actuators for x in actuator.all(_ROS2)]
    # ros2_control reads both, but a simple transmission uses only the reduction of its joint.
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
