"""What is compared, torques or positions, and what the gap is a share of, in words."""

from __future__ import annotations

from typing import Literal

Compared = Literal["torques", "positions"]
"""Positions where no torque was logged. Their errors are converted to torque by the stated gains."""

VelocityFrom = Literal["logged", "positions"]
"""Source of the velocities whose errors stand beside those of positions: logged, or the slope of positions."""

_TORQUE = {"torques": "torque", "positions": "commanded torque"}
_GAP = {"torques": "gap", "positions": "gap of positions"}

FROM_POSITIONS = "Positions under the same targets. Errors are given as the torque that the stated gains command."


def torque_of(compared: Compared) -> str:
    """Return the name of the torque that the gap is a share of."""
    return _TORQUE[compared]


def gap_of(compared: Compared) -> str:
    """Return the name of the gap."""
    return _GAP[compared]


MOTION_HEAD = ("position before", "after", "noise", "velocity before", "after", "noise")
"""Columns of `MotionErrors.rows`."""
_VELOCITY = {
    "logged": "Velocities are those logged",
    "positions": "Velocities are the slope of positions",
}


def motion_words(source: VelocityFrom) -> str:
    """Return a caption for errors of position and velocity."""
    return (
        "Errors of position and velocity: rms on validation logs, motor side, in rad and rad/s (m and m/s on a "
        f"sliding axis). {_VELOCITY[source]}."
    )
