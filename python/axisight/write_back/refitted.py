"""Gains of a controller of targets that were re-fitted: no causes, but numbers that a model says."""

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
    """A gain of an axis (from 1): its name (``j1.kp``), and by what share of the stated one it is another.

    ``gain``: its key in robot files (``kp``).
    """

    label: str
    axis: int
    stated: float
    change: Interval
    gain: str

    @property
    def value(self) -> float:
        """The gain that was found, motor side [unit of the stated one]."""
        return self.stated * (1 + self.change.value)

    @property
    def standard_error(self) -> float:
        """Its standard error."""
        return self.stated * (self.change.high - self.change.low) / (2 * NORMAL_DEVIATIONS)

    @property
    def words(self) -> str:
        """What a comment says of it."""
        low, value, high = (1 + x for x in (self.change.low, self.change.value, self.change.high))
        return (
            f"{self.label}: {value:.4g} ({low:.4g} to {high:.4g}) times the stated gain, re-fitted"
        )


def refitted_gains(robot: Robot, refit: Mapping[str, Interval]) -> list[Refitted]:
    """Return the gains among what was re-fitted, by name; masses and friction stay as they are."""
    found = []
    for name in gain_names(robot):
        if name in refit:
            joint, gain = name.rsplit(".", 1)
            axis = robot.axis_names.index(joint) + 1
            stated = float(robot.controller_gains[gain][axis - 1])
            found.append(Refitted(name, axis, stated, refit[name], gain))
    return found


def factors(gains: Sequence[Refitted]) -> tuple[float, float]:
    """Return what gains of position and of speed, ``kp`` and ``kd``, are times the stated ones."""
    found = {gain.gain: 1 + gain.change.value for gain in gains}
    return found.get("kp", 1.0), found.get("kd", 1.0)
