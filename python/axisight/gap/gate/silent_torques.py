"""Finds axes that travel and whose torque carries nothing: a dead current, or a channel that was never recorded.

Such an axis is set aside: nothing is fitted to its torque, and its verdict is *not judged*. The others go on. Their
torques need its motion, not its torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_dynamics.axis_travel import travels
from axisight.gap.gate.by_dynamics.inverse_checks import thinned
from axisight.gap.gate.by_dynamics.torque_fit import EXPLAINED, torque_fit
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.gate.log_only import moves
from axisight.gap.signals.noise import white_std
from axisight.logs import Log
from axisight.logs.quality import is_constant
from axisight.robot import Robot


def silent_axes(robot: Robot, logs: Sequence[Log]) -> tuple[int, ...]:
    """Return the axes (from 0) whose torque carries nothing in any log; none where all torques do not.

    On an axis that travels, a torque carries nothing if it never changes. Nor does one that is smaller than its own
    noise within the band of the motion, where neither the simulator nor friction explains it. The torque of an axis
    at rest may be constant.
    """
    if not logs or any(log.n_axes != robot.n_axes for log in logs):
        return ()
    constant = np.array([[is_constant(x) for x in log.torque_nm.T] for log in logs])
    noise = np.array([_says_nothing(robot, log) for log in logs])
    dead = constant & [moves(log) for log in logs]
    silent = np.all(constant | noise, axis=0) & np.any(dead | noise, axis=0)
    return () if silent.all() else tuple(np.flatnonzero(silent).tolist())


def _says_nothing(robot: Robot, log: Log) -> list[bool]:
    """Return whether the torque of each axis is unexplained and smaller than its noise."""
    _, at = thinned(log)
    small = at[3].std(axis=0) < white_std(log.torque_nm, log.sample_time_s)
    asked = small & travels(log)
    if not asked.any():
        return [False] * log.n_axes
    fit = torque_fit(at[3], predict(robot, at), at)
    return list(asked & (np.minimum(fit.left, fit.left_turned) > 1.0 - EXPLAINED))


def without_silent(logs: Sequence[Log], silent: Sequence[int]) -> list[Log]:
    """Return logs without the torque of ``silent`` axes (from 0), and without references, which need all torques."""
    if not silent:
        return list(logs)
    out = []
    for log in logs:
        torque = log.torque_nm.copy()
        torque[:, list(silent)] = 0.0
        out.append(replace(log, torque_nm=torque, velocity_ref_rad_s=None))
    return out


def set_aside(findings: Sequence[Finding], silent: Sequence[int]) -> list[Finding]:
    """Return the findings with torques of ``silent`` axes (from 0) flagged as set aside, and one of each other axis."""
    axes = [axis + 1 for axis in silent]
    out = []
    for f in findings:
        mine = f.name == "channel_constant" and f.axis in axes and f.field.startswith("torque")
        out.append(
            replace(f, severity="flag", message=f"{f.message}. {_NOT_JUDGED}") if mine else f
        )
    told = {f.axis for f in out if f.name == "channel_constant" and f.field.startswith("torque")}
    return out + [
        Finding(
            "channel_dead",
            "flag",
            "expected a torque that moves the axis, got one that follows no motion and is smaller than its noise. Is "
            f"the channel connected? {_NOT_JUDGED}",
            None,
            axis,
            f"torque_cmd_{axis}",
        )
        for axis in axes
        if axis not in told
    ]


_NOT_JUDGED = "The axis is not judged; the others are, by inverse dynamics"
