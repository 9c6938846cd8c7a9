"""Limits of force of an MJCF, which stand behind the gains: of actuators before their gear, and of joints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from axisight.effects.stated import TORQUE_CONSTANT, TORQUE_LIMIT
from axisight.robot import Robot
from axisight.robot_import.bodies import Drive
from axisight.write_back.xml_edits import Numbers

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

LIMIT_EFFECTS = frozenset((TORQUE_LIMIT[0], TORQUE_CONSTANT[0]))
"""Causes that change what a limit of force has to be."""


@dataclass(frozen=True)
class Limits:
    """What an MJCF limits of one joint, and what the robot that was diagnosed does.

    ``drive``: of the file; ``own_nm``: limit of the robot before the causes, motor side; ``ratio``: of its
    gear, which is not the file's where the drive data have another one.
    """

    drive: Drive
    own_nm: float
    ratio: float

    @property
    def alike(self) -> bool:
        """Whether what the file limits it does the same both ways, as a torque is limited."""
        return not any(math.isnan(x) for x in self.drive.force_limits)

    def of_actuator(self, limit_nm: float) -> float:
        """Return a limit [Nm] of the robot's motor as one before the gear of the file."""
        return limit_nm * abs(self.drive.gear_ratio / self.ratio)

    def set_by(
        self, causes: Sequence[Cause], *, servo: bool
    ) -> tuple[Mapping[str, Numbers], Mapping[str, Numbers]]:
        """Return attributes of the actuator and of the joint, so that the limit of the causes is what acts.

        Gains stand before them: a motor that gives less is limited by less. ``servo``: the actuator has no
        limit of a command that would be one of torque.
        """
        limit, gain = self.own_nm, 1.0 if servo else self.drive.gain
        for cause in causes:
            if cause.effect == TORQUE_LIMIT[0]:
                limit = cause.parameters[TORQUE_LIMIT[1]].value
            if cause.effect == TORQUE_CONSTANT[0]:
                gain = 1 + cause.parameters[TORQUE_CONSTANT[1]].value
        given = self.of_actuator(limit) * gain
        if not math.isfinite(given) or not any(c.effect in LIMIT_EFFECTS for c in causes):
            return {}, {}
        of_actuator, of_joint = self.drive.force_limits
        new = any(cause.effect == TORQUE_LIMIT[0] for cause in causes)
        actuator: Mapping[str, Numbers] = {}
        joint: Mapping[str, Numbers] = {}
        if (servo and new) or math.isfinite(of_actuator):
            actuator = {"forcelimited": "true", "forcerange": (-given, given)}
        if math.isfinite(of_joint):
            most = given / abs(self.drive.gear_ratio)
            joint = {"actuatorfrclimited": "true", "actuatorfrcrange": (-most, most)}
        return actuator, joint


def limits_of(drive: Drive, robot: Robot, axis: int) -> Limits:
    """Return the limits of an axis (from 0) of a robot, whose ``drive`` a file says."""
    mine = [e for e in robot.effects if e.name == TORQUE_LIMIT[0] and e.axis == axis + 1]
    own = mine[0].values()[0] if mine else math.inf
    return Limits(drive, own, float(robot.gear_ratio[axis]))
