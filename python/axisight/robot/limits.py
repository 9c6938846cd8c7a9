"""Limits of a joint as a description states them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from axisight.display.summary import summarized


@summarized
@dataclass(frozen=True)
class JointLimits:
    """What a joint may do, on the joint side; None where nothing is stated.

    ``position``: smallest and largest angle [rad, or m on a prismatic joint]. ``velocity`` [rad/s or m/s],
    ``acceleration`` [rad/s^2 or m/s^2] and ``effort`` [Nm or N] are largest values in either direction. No simulation
    stops at them.
    """

    position: tuple[float, float] | None = None
    velocity: float | None = None
    acceleration: float | None = None
    effort: float | None = None

    def stated(self) -> dict[str, Any]:
        """Return the stated limits as a table ``[joint.limits]`` of a robot file."""
        known = {name: value for name, value in asdict(self).items() if value is not None}
        return known | ({"position": list(self.position)} if self.position else {})


def limits_of(document: Mapping[str, Any]) -> tuple[JointLimits, ...]:
    """Return the limits of the driven joints (n_axes) of a robot file that the reader has accepted."""
    driven = (joint for joint in document["joint"] if joint["kind"] == "driven")
    return tuple(_limits(joint.get("limits", {})) for joint in driven)


def _limits(table: Mapping[str, Any]) -> JointLimits:
    low_high = [float(x) for x in table.get("position", ())]
    velocity, acceleration, effort = (
        float(table[name]) if name in table else None
        for name in ("velocity", "acceleration", "effort")
    )
    position = (low_high[0], low_high[1]) if low_high else None
    return JointLimits(position, velocity, acceleration, effort)
