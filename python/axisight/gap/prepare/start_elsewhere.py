"""Tells whether the machine begins elsewhere than the simulation, and compares such logs from later on.

A simulation begins at rest, with gears and joints in equilibrium. A machine may begin otherwise: a brake has just
opened, or the arm still swings. That error is the same in every log, whatever the motion, and fades. A fit would
charge it to the parameters of the arm. The simulation is therefore kept on each log until it has forgotten its start.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.prepare.log_start import SEVERAL, differ
from axisight.gap.prepare.run_up import NotRunUpError, compared_after_start
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Ratio of the mean square of the error in the first block of every log to that in the others.
_STANDS_OUT = 4.0
# Share of the squared error of the first blocks that all logs have in common.
_IN_COMMON = 0.5


def begins_elsewhere(
    robot: Robot, logs: Sequence[Log], fitted: FittedModel, floor: Array, settings: Settings
) -> bool:
    """Whether one error, the same in all logs, makes the first block of every log stand out.

    For three logs and more of one pose with different first references. ``fitted``: the re-fitted simulator;
    ``floor`` (n_blocks,): the loss of noise alone. What the arm itself lacks depends on the motion, or lasts.
    """
    if len(logs) < SEVERAL or not differ(robot, logs):
        return False
    first = _first_blocks(fitted)
    above = fitted.loss - floor
    for log in range(len(logs)):
        mine = fitted.log == log
        if not np.any(mine & ~first):
            return False
        begun, later = (_mean(above, fitted, mine & part) for part in (first, ~first))
        if begun <= max(_STANDS_OUT * later, settings.largest_scatter):
            return False
    return _in_common(fitted, first) > _IN_COMMON


def _first_blocks(fitted: FittedModel) -> NDArray[np.bool_]:
    """Return a mask (n_blocks,) of the first block of each log and axis."""
    first = np.zeros(len(fitted.log), bool)
    for log, axis in set(zip(fitted.log.tolist(), fitted.axis.tolist(), strict=True)):
        rows = np.flatnonzero((fitted.log == log) & (fitted.axis == axis))
        first[rows[np.argmin(fitted.start[rows])]] = True
    return first


def _mean(above: Array, fitted: FittedModel, blocks: NDArray[np.bool_]) -> float:
    return float(above[blocks].sum() / max(fitted.samples[blocks].sum(), 1e-300))


def _in_common(fitted: FittedModel, first: NDArray[np.bool_]) -> float:
    """Return the share of the squared residual of the first blocks that their mean over logs has [1]."""
    common = whole = 0.0
    for axis in np.unique(fitted.axis):
        rows = np.flatnonzero(first & (fitted.axis == axis))
        n = int(fitted.size[rows].min())
        curves = np.array([fitted.residual[fitted.start[k] : fitted.start[k] + n] for k in rows])
        common += len(rows) * float((curves.mean(axis=0) ** 2).sum())
        whole += float((curves**2).sum())
    return common / max(whole, 1e-300)


def compared_later(loops: Sequence[Robot], logs: Sequence[Log]) -> list[Log] | None:
    """Return the logs as they are compared once the simulation has forgotten its start; None if one is too short.

    ``loops``: the robot with every controller that it is simulated with.
    """
    try:
        return [log if log.run_up is not None else compared_after_start(loops, log) for log in logs]
    except (NotRunUpError, InputError):
        return None


def said(logs: Sequence[Log]) -> Finding:
    """Return the finding about logs that begin elsewhere, from `compared_later`."""
    seconds = max(log.lead * log.sample_time_s for log in logs)
    message = (
        "expected a start at rest in equilibrium, like the simulation, got one error at the start of every log that "
        f"fades, whatever the motion. The logs are compared from {seconds:.4g} s, where the simulation has forgotten "
        "its start. Let the arm settle before a log begins"
    )
    return Finding("begins_elsewhere", "flag", message, logs[0].name, None, "position")
