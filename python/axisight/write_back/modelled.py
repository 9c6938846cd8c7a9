"""A modelled remainder in a robot file, with the own parameters of the simulator that it belongs to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from axisight.fitting import robot_parameters
from axisight.gap.simulator.own_parameters import nominal_and_size
from axisight.remainder import ModelledRemainder
from axisight.robot import Robot
from axisight.statistics.intervals import NORMAL_DEVIATIONS

if TYPE_CHECKING:
    from axisight.gap.facts.result import Interval

REMAINDER = "remainder"
"""Label of a modelled remainder among what a model contains."""
TWICE = "the robot file has one already: diagnose the robot without it, robot.with_remainder(None)"
"""Reason why a robot file takes no further remainder."""


@dataclass(frozen=True)
class Own:
    """Re-fitted own parameters by name, in SI units, with their standard errors."""

    values: dict[str, float] = field(default_factory=dict)
    standard_errors: dict[str, float] = field(default_factory=dict)


def why_not(kind: str) -> str:
    """Return why a URDF or MJCF takes no remainder; ``kind`` is the tag of its root."""
    if kind == "mujoco":
        return (
            "MJCF has no table for it: --remainder-table writes one, and "
            "axisight.mujoco.apply_remainder adds it at every step"
        )
    return "URDF has no table for it: --remainder-table writes one, a robot file (.toml) has it"


def with_modelled(
    robot: Robot, modelled: ModelledRemainder, refit: Mapping[str, Interval]
) -> tuple[Robot, Own]:
    """Return the robot with the remainder, and the re-fitted own parameters that belong to it.

    ``refit``: `Diagnosis.refit`. A remainder of the simulator with its stated own parameters needs none.
    """
    made = robot.with_remainder(modelled.model)
    if modelled.own_parameters == "stated":
        return made, Own()
    own = Own()
    for name in robot_parameters(robot):
        if name in refit:
            nominal, size = nominal_and_size(robot, name)
            spread = (refit[name].high - refit[name].low) / (2 * NORMAL_DEVIATIONS)
            own.values[name] = nominal + size * refit[name].value
            own.standard_errors[name] = size * spread
    return made, own
