"""Checks the start of closed-loop logs, and the torque that holds the arm, against the robot at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.simulator.start_poses import OFFSET_RAD
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate

# Smallest mean of a simulated torque, as a share of its rms, that counts as caused by gravity.
_GRAVITY_SHARE = 0.5
# Range of measured over simulated mean that shows gravity with the wrong sign: within a factor of two, for a
# payload or its absence.
_TURNED_ROUND = (-2.0, -0.5)


def check_start(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return findings about the first positions of the logs, and the sign of gravity."""
    out = []
    rest = robot.equilibrium()["motor_angle_rad"].values
    for log in logs:
        off = (log.position_rad[0] - rest) * robot.gear_ratio
        if log.start_rad is not None:
            continue
        for axis in np.flatnonzero(np.abs(off) > OFFSET_RAD):
            message = (
                f"expected a log that starts at the robot's operating point, got a start {off[axis]:.4g} rad "
                "(joint side) away from it. The simulator starts at the operating point. Write the pose into the "
                "robot file, or subtract the offset of the encoder"
            )
            column = f"position_{axis + 1}"
            out.append(Finding("position_offset", "flag", message, log.name, int(axis) + 1, column))
    return out + _gravity(robot, logs[0])


def _gravity(robot: Robot, log: Log) -> list[Finding]:
    """Return a refusal if the mean torques show gravity with the other sign.

    Friction and motion nearly cancel in a mean; gravity stays.
    """
    references = log.led("velocity_ref_rad_s")
    run = simulate(robot, references, method="rk4", start_rad=log.start_rad)
    simulated = run["torque_cmd_nm"].values[log.lead :]
    if len(simulated) < log.n_samples or not np.isfinite(simulated).all():
        return []
    mean, expected = log.torque_nm.mean(axis=0), simulated.mean(axis=0)
    rms = np.sqrt((simulated**2).mean(axis=0))
    holds = np.abs(expected) > _GRAVITY_SHARE * rms
    ratio = mean[holds] / expected[holds]
    if not holds.any() or not np.all((ratio > _TURNED_ROUND[0]) & (ratio < _TURNED_ROUND[1])):
        return []
    axes = ", ".join(str(i + 1) for i in np.flatnonzero(holds))
    message = (
        "expected mean torques like the simulator's, got them with the other sign on every axis that holds a "
        f"load ({axes}; factors {', '.join(f'{r:.3g}' for r in ratio)}). Change the sign of gravity in the robot "
        "file, or that of the torques"
    )
    return [Finding("gravity_flipped", "refuse", message, None, None, "gravity")]
