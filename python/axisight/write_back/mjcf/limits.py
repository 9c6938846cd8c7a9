"""Force limits of an MJCF, which act after the gains: of actuators, before their gear, and of joints."""

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
"""Causes that change a force limit."""


@dataclass(frozen=True)
class Limits:
    """Limits of one joint in an MJCF, and of the diagnosed robot.

    - ``drive``: of the file.
    - ``own_nm``: limit of the robot before the causes, motor side.
    - ``ratio``: gear ratio of the robot, which differs from the file's if the drive data state another.
    """

    drive: Drive
    own_nm: float
    ratio: float

    @property
    def alike(self) -> bool:
        """Whether the file's limit is the same in both directions, like a torque limit."""
        return not any(math.isnan(x) for x in self.drive.force_limits)

    def of_actuator(self, limit_nm: float) -> float:
        """Return a motor-side limit [Nm] as a limit before the file's gear."""
        return limit_nm * abs(self.drive.gear_ratio / self.ratio)

    def signed(self, torque_nm: float) -> float:
        """Return a motor-side torque [Nm] as a torque before the file's gear, with its sign."""
        return torque_nm * self.drive.gear_ratio / self.ratio

    def set_by(
        self, causes: Sequence[Cause], *, servo: bool
    ) -> tuple[Mapping[str, Numbers], Mapping[str, Numbers]]:
        """Return attributes of actuator and joint that make the causes' limit effective.

        Gains act before force limits, so a motor with less gain needs a smaller limit. ``servo``: the
        actuator has no limit of its command that would limit the torque.
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
    """Return the limits of a robot's axis (from 0), with ``drive`` from the file."""
    mine = [e for e in robot.effects if e.name == TORQUE_LIMIT[0] and e.axis == axis + 1]
    own = mine[0].values()[0] if mine else math.inf
    return Limits(drive, own, float(robot.gear_ratio[axis]))
