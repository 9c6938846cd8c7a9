"""Late encoders as delayed sensors of an MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from axisight.effects.stated import LATE_READING
from axisight.robot_import.bodies import Drive
from axisight.robot_import.xml_tree import Element
from axisight.write_back.mjcf.servos import DELAYS_SINCE, delayed
from axisight.write_back.mjcf.versions import too_old
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

READING_EFFECTS = frozenset((LATE_READING[0],))
"""Effects that delayed sensors express."""

SENSORS = ("jointpos", "jointvel")
"""Tags of the sensors of a joint whose values come from its encoder."""


def write_readings(
    edits: Edits, root: Element, joint: str, drive: Drive, causes: Sequence[Cause], step_s: float
) -> Placed:
    """Write the delay of an encoder into the sensors of a joint; ``step_s`` [s]: time step of the model.

    What reads ``sensordata`` then reads late. Actuators read no sensors.
    """
    placed = Placed()
    of_joint = [
        sensor
        for holder in root.all("sensor")
        for sensor in holder.children
        if sensor.tag in SENSORS and sensor.attributes.get("joint") == joint
    ]
    if why := too_old(DELAYS_SINCE, "delays of sensors"):
        placed.refuse(causes, why)
    elif drive.servo is not None:
        placed.refuse(
            causes, "an actuator that is told positions reads no sensor, and so none late"
        )
    elif SENSORS[0] not in [sensor.tag for sensor in of_joint]:
        placed.refuse(
            causes, f"expected a <{SENSORS[0]}> of the joint, from which its angle is read"
        )
    else:
        for cause in causes:
            made = delayed(cause.parameters[LATE_READING[1]].value, step_s)
            for sensor in of_joint:
                edits.set(sensor, made, said([cause]))
        placed.take(causes)
    return placed
