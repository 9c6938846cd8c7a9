"""Finds positions and targets beyond the range of a joint that the model file states."""

from __future__ import annotations

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.simulator.start_poses import OFFSET_RAD
from axisight.logs import Log
from axisight.robot import Robot


def check_ranges(robot: Robot, log: Log) -> list[Finding]:
    """Return a flag for each axis whose positions or targets pass the stated range by more than another pose.

    The machine stops there, or its zero is another one. No simulation stops.
    """
    if log.n_axes != robot.n_axes:
        return []
    out = []
    for axis, stated in enumerate(robot.joint_ranges):
        if stated is None:
            continue
        for field, signal in (
            ("position", log.position_rad),
            ("position_ref", log.position_ref_rad),
        ):
            if signal is None or not np.isfinite(signal[:, axis]).all():
                continue
            angle = signal[:, axis] * robot.gear_ratio[axis]
            low, high = float(angle.min()), float(angle.max())
            if low >= stated[0] - OFFSET_RAD and high <= stated[1] + OFFSET_RAD:
                continue
            message = (
                f"expected joint angles within the range of the model file, {stated[0]:.4g} to {stated[1]:.4g}, got "
                f"{low:.4g} to {high:.4g}. A machine stops there and the simulator does not. Check the zero of the "
                "encoder and the range, or leave this part of the log out"
            )
            column = f"{field}_{axis + 1}"
            out.append(Finding("range_passed", "flag", message, log.name, axis + 1, column))
    return out
