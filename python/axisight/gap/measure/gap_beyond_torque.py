"""Gaps of more than ten times the torque: what may be wrong there, in words."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.compared_quantity import Compared
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import Gap
from axisight.gap.facts.wording import LARGEST
from axisight.logs import Log

Array = NDArray[np.float64]

_WHAT: dict[Compared, tuple[str, str]] = {
    "torques": ("the logged torque", "torque_cmd"),
    "positions": ("the torque that the gains command along the logged positions", "position"),
}
# A torque whose scatter is so small a share of its size hardly changes.
_CONSTANT = 0.01
# Share of samples at the extremes of a torque that was cut there.
_CUT = 0.05


def beyond_torque(
    gap: Gap, logs: Sequence[Log], silent: Collection[int] = ()
) -> tuple[Finding, ...]:
    """Return a finding for every axis whose simulator is off by more than ten times the torque, or broke off.

    ``silent``: axes (from 0) that are not judged.
    """
    off = gap.before_per_axis
    axes = [axis for axis in np.flatnonzero(~(off <= LARGEST)).tolist() if axis not in silent]
    return tuple(_finding(axis, float(off[axis]), logs, gap.compared) for axis in axes)


def _finding(axis: int, off: float, logs: Sequence[Log], compared: Compared) -> Finding:
    what, column = _WHAT[compared]
    how = (
        f"is off by more than ten times the standard deviation of {what}"
        if np.isfinite(off)
        else "broke off: its loop is unstable along these logs"
    )
    message = f"axis {axis + 1}: the simulator {how}. {_reason(axis, logs)}"
    return Finding("gap_beyond_torque", "flag", message, None, axis + 1, f"{column}_{axis + 1}")


def _reason(axis: int, logs: Sequence[Log]) -> str:
    torques = [log.torque_nm[:, axis] for log in logs]
    if all(np.std(u) <= _CONSTANT * np.abs(u).max(initial=0.0) for u in torques):
        return (
            "That torque hardly changes. Check for a constant channel or an axis that never moved"
        )
    if any(_cut(u) for u in torques):
        return "That torque is cut at a limit: the machine did not get the commanded torque. Log below the limit"
    return (
        "With a wrong gear ratio, unit of torque, direction of gravity or controller a simulator cannot hold "
        "itself. Check these in the robot file"
    )


def _cut(torque: Array) -> bool:
    at_limit = np.isin(torque, (torque.min(), torque.max()))
    return bool(at_limit.mean() > _CUT)
