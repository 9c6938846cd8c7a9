"""What simulator and machine are compared by, and what the figures of the gap are shares of, in words."""

from __future__ import annotations

from typing import Literal

Compared = Literal["torques", "positions"]
"""Positions where no torque was logged: their errors are told as the torque that the stated gains make of them."""

_TORQUE = {"torques": "torque", "positions": "commanded torque"}
_GAP = {"torques": "gap", "positions": "gap of positions"}

FROM_POSITIONS = "Positions under the same targets, their errors told as the torque that the stated gains command."


def torque_of(compared: Compared) -> str:
    """Return what the torque is called that figures of the gap are shares of."""
    return _TORQUE[compared]


def gap_of(compared: Compared) -> str:
    """Return what the gap is called."""
    return _GAP[compared]
