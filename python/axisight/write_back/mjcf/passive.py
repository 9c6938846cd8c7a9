"""Cogging, balance springs and friction with bristles as passive ``dcmotor`` actuators of an MJCF."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from axisight.effects.dcmotor import Cogging, Device, devices_of
from axisight.robot import Robot
from axisight.robot_import.bodies import Drive
from axisight.robot_import.load import felt_inertia
from axisight.robot_import.xml_tree import Element
from axisight.write_back.mjcf.versions import too_old
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits, Numbers

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

TAG = "dcmotor"
"""Tag of the actuator that adds cogging and LuGre friction."""

SINCE = (3, 12)
"""First version of MuJoCo whose ``dcmotor`` can be without inputs."""

# Without inputs the motor is shorted and would brake the joint. MuJoCo before 4.0 refuses a constant of zero [Nm/A].
_NO_MOTOR = "1e-9 0"
# What the defaults of a file would give the actuator.
_PLAIN = {
    "damping": "0",
    "armature": "0",
    "delay": "0",
    "nsample": "0",
    "ctrllimited": "false",
    "saturation": "0 0 0",
}


def write_devices(
    edits: Edits,
    root: Element,
    drive: Drive,
    robot: Robot,
    axis: int,
    causes: Sequence[Cause],
    step_s: float,
) -> Placed:
    """Write causes of one axis (from 0) as passive actuators of its joint, behind all other actuators.

    They have no command, so the commands of the other actuators keep their places. ``drive`` is that of the
    file, ``step_s`` its time step [s].
    """
    placed, name = Placed(), robot.axis_names[axis]
    stated = {effect.label for effect in robot.effects}
    defaults = any(e.tag in ("default", "include") for e in root.walk())
    children: list[tuple[str, Mapping[str, Numbers]]] = []
    for cause in causes:
        found = devices_of(
            cause.as_effect(),
            float(robot.gear_ratio[axis]),
            step_s=step_s,
            inertia_kg_m2=float(felt_inertia(robot)[axis]),
        )
        if why := too_old(SINCE, f"<{TAG}> without input"):
            placed.refuse([cause], why)
        elif cause.label in stated:
            placed.refuse([cause], "the file has one already: change its numbers by hand")
        elif drive.force_limits[1] != math.inf:
            placed.refuse(
                [cause], "the joint limits the force of its actuators, which would include it"
            )
        elif isinstance(found, str):
            placed.refuse([cause], found)
        else:
            many = len(found) > 1
            for number, device in enumerate(found, start=1):
                called = f"{cause.effect} {number if many else ''}".strip()
                own = {"name": f"{called} of {name}", "joint": name, **_attributes(device)}
                children.append((TAG, own | (_PLAIN if defaults else {})))
            placed.take([cause])
    if children:
        comment = said([cause for cause in causes if cause.label in placed.there])
        holders = root.all("actuator")
        edits.append(
            holders[-1] if holders else root,
            children,
            comment,
            within="" if holders else "actuator",
        )
    return placed


def _attributes(device: Device) -> Mapping[str, Numbers]:
    """Return the attributes of a passive actuator with the torque of a device."""
    torque: Mapping[str, Numbers]
    if isinstance(device, Cogging):
        torque = {"cogging": (device.amplitude_nm, device.order, device.phase_rad)}
    else:
        torque = {
            "lugre": (
                device.stiffness_nm_rad,
                device.damping_nm_s_rad,
                device.coulomb_nm,
                device.static_nm,
                device.stribeck_speed_rad_s,
            )
        }
    return {
        "gear": device.gear,
        "motorconst": _NO_MOTOR,
        "resistance": "1",
        "input": "none",
        **torque,
    }
