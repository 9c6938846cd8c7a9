"""Sensors on the arm that a fit compares beside the motors: joint encoders and accelerometers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import did_you_mean
from axisight.errors import InputError
from axisight.fitting.weighting import Weighting
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]
Kind = Literal["joint_angle", "acceleration"]
CoreOutput = tuple[Kind, int, tuple[list[float], list[float], int]]


@dataclass(frozen=True)
class SensedOutputs:
    """The compared readings of one kind.

    ``weighting`` has a row for each reading. ``measured`` holds the readings (n, n_readings) of each log, NaN
    for a sensor that it lacks; None for a log without any.
    """

    kind: Kind
    weighting: Weighting
    measured: tuple[Array | None, ...]

    def core(self) -> list[CoreOutput]:
        """Return kind, index and weighting of each reading, in the form of the compiled core."""
        return [(self.kind, index, one) for index, one in enumerate(self.weighting.core())]


def joint_angles(logs: Sequence[Log], weighting: Weighting) -> SensedOutputs:
    """Return the joint encoders of the logs; raise InputError if no log has any."""
    if all(log.joint_position_rad is None for log in logs):
        raise InputError(
            "joint_weighting: expected logs with joint_position_rad (columns joint_position_N), got none"
        )
    measured = tuple(log.joint_position_rad for log in logs)
    return _with_rows(SensedOutputs("joint_angle", weighting, measured), logs[0].n_axes)


def accelerations(robot: Robot, logs: Sequence[Log], weighting: Weighting) -> SensedOutputs:
    """Return the accelerometers of the logs, in the order of those of the robot.

    Raises InputError if no log has any, and for one that the robot does not have.
    """
    measured = tuple(acceleration_readings(robot, log) for log in logs)
    if all(readings is None for readings in measured):
        raise InputError(
            "acceleration_weighting: expected logs with acceleration_m_s2 (columns acceleration_NAME_x), got "
            "none"
        )
    return _with_rows(SensedOutputs("acceleration", weighting, measured), n_readings(robot))


def n_readings(robot: Robot) -> int:
    """Return the number of readings of all accelerometers of a robot."""
    return sum(len(one.directions) for one in robot.accelerometers)


def acceleration_readings(robot: Robot, log: Log) -> Array | None:
    """Return the readings (n, n_readings) of a log, in the order of the robot's accelerometers.

    A reading that the log lacks is NaN; without any the result is None. Raises InputError for an accelerometer
    that the robot does not have, and for a direction that it does not measure.
    """
    if not log.acceleration_m_s2:
        return None
    known = {one.name: len(one.directions) for one in robot.accelerometers}
    for name, readings in log.acceleration_m_s2.items():
        if name not in known:
            raise InputError(
                f"{log.name}: acceleration_m_s2: expected accelerometers of the robot "
                f"({', '.join(known) or 'it has none'}), got {name!r}{did_you_mean(name, known)}; state it as "
                "[[accelerometer]] in the robot file, or leave it out of the log"
            )
        if np.isfinite(readings[:, known[name] :]).any():
            raise InputError(
                f"{log.name}: acceleration_m_s2[{name!r}]: expected {known[name]} directions, as the robot "
                "states, got more"
            )
    missing = np.full((log.n_samples, 3), np.nan)
    parts = [log.acceleration_m_s2.get(name, missing)[:, :count] for name, count in known.items()]
    return np.concatenate(parts, axis=1)


def core_readings(sensed: Sequence[SensedOutputs], logs: Sequence[Log]) -> list[Array | None]:
    """Return the readings (lead + n, n_readings) of all kinds of each log; None for a log without any."""
    out: list[Array | None] = []
    for number, log in enumerate(logs):
        parts = []
        for one in sensed:
            shape = (log.n_samples, len(one.weighting.weight))
            readings = one.measured[number]
            parts.append(np.full(shape, np.nan) if readings is None else readings)
        if all(one.measured[number] is None for one in sensed):
            out.append(None)
            continue
        together = np.concatenate(parts, axis=1)
        # Samples of the run-up are not compared.
        before = np.zeros((log.lead, together.shape[1]))
        out.append(np.ascontiguousarray(np.concatenate([before, together])))
    return out


def _with_rows(sensed: SensedOutputs, expected: int) -> SensedOutputs:
    """Return the outputs, if their weighting has a row for each reading; else raise InputError."""
    rows = len(sensed.weighting.weight)
    if rows != expected:
        field = {"joint_angle": "joint_weighting", "acceleration": "acceleration_weighting"}
        raise InputError(f"{field[sensed.kind]}: expected {expected} rows of weights, got {rows}")
    return sensed
