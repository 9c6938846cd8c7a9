"""A remainder that the robot file states: its torque along the logs is not looked for again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.errors import InputError
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.modelled.records import course_of, gear_load
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.remainder import Remainder

SAYS = (
    "The remainder of the robot file was computed along the measured motions and subtracted from "
    "the measured torque."
)
"""What a diagnosis says of it."""


def without_stated(
    logs: Sequence[Log], remainder: Remainder, view: View, settings: Settings
) -> list[Log]:
    """Return the logs with the measured torque less that of the robot's remainder along their motion.

    The references of a closed loop stay: they are followed without the remainder, by a command that lacks its torque.
    Raises InputError if no torque was logged.
    """
    if view.by_targets:
        raise InputError(
            "robot: expected one without a remainder for logs without torque; robot.with_remainder(None) is without it"
        )
    seen = view
    if not isinstance(seen, InverseView):
        seen = InverseView(view.robot, view.logs, settings, logs, view.silent)
    out = []
    for log in logs:
        course = course_of(seen, log, gear_load(seen, log, Variant({}, ())))
        out.append(replace(log, torque_nm=log.torque_nm - remainder.torque(course)))
    return out
