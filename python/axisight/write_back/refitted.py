"""Re-fitted gains of a controller with position targets, which are no causes but stand in models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from axisight.gap.simulator.own_parameters import gain_names
from axisight.robot import Robot
from axisight.statistics.intervals import NORMAL_DEVIATIONS

if TYPE_CHECKING:
    from axisight.gap.facts.result import Interval


@dataclass(frozen=True)
class Refitted:
    """A re-fitted gain of an axis (from 1): its name (``j1.kp``) and its relative change [1].

    ``gain``: its key in robot files (``kp``).
    """

    label: str
    axis: int
    stated: float
    change: Interval
    gain: str

    @property
    def value(self) -> float:
        """The re-fitted gain, motor side, in the unit of the stated one."""
        return self.stated * (1 + self.change.value)

    @property
    def standard_error(self) -> float:
        """Standard error of the gain, in the same unit."""
        return self.stated * (self.change.high - self.change.low) / (2 * NORMAL_DEVIATIONS)

    @property
    def words(self) -> str:
        """Text of the gain for a comment."""
        low, value, high = (1 + x for x in (self.change.low, self.change.value, self.change.high))
        return (
            f"{self.label}: {value:.4g} ({low:.4g} to {high:.4g}) times the stated gain, re-fitted"
        )


def refitted_gains(robot: Robot, refit: Mapping[str, Interval]) -> list[Refitted]:
    """Return the re-fitted gains, by name; re-fitted masses and friction are left out."""
    found = []
    for name in gain_names(robot):
        if name in refit:
            joint, gain = name.rsplit(".", 1)
            axis = robot.axis_names.index(joint) + 1
            stated = float(robot.controller_gains[gain][axis - 1])
            found.append(Refitted(name, axis, stated, refit[name], gain))
    return found


def factors(gains: Sequence[Refitted]) -> tuple[float, float]:
    """Return the factors on the stated gains of position and speed, ``kp`` and ``kd``."""
    found = {gain.gain: 1 + gain.change.value for gain in gains}
    return found.get("kp", 1.0), found.get("kd", 1.0)
