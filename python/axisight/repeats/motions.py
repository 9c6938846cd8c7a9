"""Filtered motions of aligned runs, and the samples that their regressions use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.logs import Log
from axisight.rigid_body.from_logs import log_motion
from axisight.rigid_body.motion import MotionEstimate
from axisight.rigid_body.reversal_window import reversal_weight
from axisight.rigid_body.standstill import at_rest

Array = NDArray[np.float64]
Whole = NDArray[np.intp]

# An axis with a smaller top speed, as a share of the top speed of all axes, stands still.
_STANDS = 1e-3


@dataclass(frozen=True, eq=False)
class RunMotions:
    """Filtered motions of runs of one motion, all with the same times.

    runs
        One motion per run.
    moving
        Axes that move, from 0.
    weight
        (n_samples, n_axes): one for samples that the regressions use, else zero. Left out are, in every
        run alike, standstill of an axis and the surroundings of its reversals.
    """

    runs: tuple[MotionEstimate, ...]
    moving: Whole
    weight: Array

    @property
    def torque(self) -> Array:
        """Low-passed torques (n_runs, n_samples, n_axes) [Nm]."""
        return np.stack([m.torque_nm for m in self.runs if m.torque_nm is not None])


def run_motions(
    logs: Sequence[Log], *, cutoff_hz: float, reversal_s: float | None, torque_held: bool
) -> RunMotions:
    """Return the motions of aligned logs; arguments as of :func:`axisight.rigid_body.identify_logs`.

    Raises InputError if no axis moves, or if reversals leave too few samples.
    """
    motions = [log_motion(log, cutoff_hz, torque_held=torque_held) for log in logs]
    top = np.max([np.abs(m.velocity_rad_s).max(axis=0) for m in motions], axis=0)
    moving = np.flatnonzero(top > _STANDS * top.max())
    if not moving.size:
        raise InputError("logs: expected a motion, got axes that all stand still")
    quiet, standing = at_rest(motions, cutoff_hz)
    moves = ~np.concatenate(standing)[:, moving]
    kept, _ = reversal_weight([_only(m, moving) for m in quiet], reversal_s, cutoff_hz, moves)
    weight = np.zeros((motions[0].n_samples, len(top)))
    weight[:, moving] = kept.reshape(len(motions), -1, len(moving)).min(axis=0)
    return RunMotions(tuple(quiet), moving, weight)


def _only(motion: MotionEstimate, axes: Whole) -> MotionEstimate:
    """Return a motion with some of its axes."""
    return replace(
        motion,
        position_rad=motion.position_rad[:, axes],
        velocity_rad_s=motion.velocity_rad_s[:, axes],
        acceleration_rad_s2=motion.acceleration_rad_s2[:, axes],
        torque_nm=None,
    )
