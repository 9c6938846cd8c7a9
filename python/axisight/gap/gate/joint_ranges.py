"""Finds positions and targets beyond the range of a joint that the model file states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.simulator.start_poses import OFFSET_RAD
from axisight.logs import Log
from axisight.robot import Robot


def check_ranges(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return a flag for each axis whose positions or targets pass the stated range by more than another pose.

    On an axis that slides, that is the same share of its travel as it is of a radian. The flag has the extremes of all
    logs, with the log and the column that go furthest. The machine stops there, or its zero is another one. No
    simulation stops.
    """
    out = []
    for axis, stated in enumerate(robot.joint_ranges):
        spans = [] if stated is None else _spans(robot, logs, axis)
        if stated is None or not spans:
            continue
        slides = robot.axis_is_prismatic[axis]
        # How far each goes beyond its range, at one end or the other.
        beyond = [max(stated[0] - low, high - stated[1]) for low, high, *_ in spans]
        furthest = int(np.argmax(beyond))
        if beyond[furthest] <= OFFSET_RAD * (stated[1] - stated[0] if slides else 1.0):
            continue
        low, high = min(s[0] for s in spans), max(s[1] for s in spans)
        unit = "m" if slides else "rad"
        message = (
            f"expected joint positions within the range of the model file, {stated[0]:.4g} to {stated[1]:.4g} {unit}, "
            f"got {low:.4g} to {high:.4g} {unit} over all logs. A machine stops there and the simulator does not. "
            "Check the zero of the encoder and the range, or leave this part of the logs out"
        )
        *_, name, column = spans[furthest]
        out.append(Finding("range_passed", "flag", message, name, axis + 1, column))
    return out


def _spans(robot: Robot, logs: Sequence[Log], axis: int) -> list[tuple[float, float, str, str]]:
    """Return the least and the greatest joint position of an axis (from 0) by log and column, with their names.

    In rad, or in m where it slides; without columns that have gaps.
    """
    out = []
    for log in logs:
        for field in ("position", "position_ref"):
            signal = getattr(log, f"{field}_rad") if log.n_axes == robot.n_axes else None
            if signal is None or not np.isfinite(signal[:, axis]).all():
                continue
            at = signal[:, axis] * robot.gear_ratio[axis]
            out.append((float(at.min()), float(at.max()), log.name, f"{field}_{axis + 1}"))
    return out
