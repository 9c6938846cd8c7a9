"""What simulator and machine are compared by, and what the figures of the gap are shares of, in words."""

from __future__ import annotations

from typing import Literal

Compared = Literal["torques", "positions"]
"""Positions where no torque was logged: their errors are told as the torque that the stated gains make of them."""

VelocityFrom = Literal["logged", "positions"]
"""Of which errors are told beside those of positions: logged, or the slope of positions."""

_TORQUE = {"torques": "torque", "positions": "commanded torque"}
_GAP = {"torques": "gap", "positions": "gap of positions"}

FROM_POSITIONS = "Positions under the same targets, their errors told as the torque that the stated gains command."


def torque_of(compared: Compared) -> str:
    """Return what the torque is called that figures of the gap are shares of."""
    return _TORQUE[compared]


def gap_of(compared: Compared) -> str:
    """Return what the gap is called."""
    return _GAP[compared]


MOTION_HEAD = ("position before", "after", "noise", "velocity before", "after", "noise")
"""What `MotionErrors.rows` has of an axis."""
_VELOCITY = {
    "logged": "velocities as they were logged",
    "positions": "velocities by the slope of positions",
}


def motion_words(source: VelocityFrom) -> str:
    """Return what the errors of position and velocity are."""
    return (
        "Errors of position and velocity, rms on held-out logs, motor side, rad and rad/s (m and m/s where an axis "
        f"slides); {_VELOCITY[source]}."
    )
