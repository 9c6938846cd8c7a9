"""Stretches in which an axis stands still while others move.

At standstill friction can have any value between its bounds, and noise decides the sign of the speed.
The rows of the axis then tell nothing about its friction, and a change of that sign is not a reversal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.rigid_body.motion import MotionEstimate

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STANDING_SHARE = 0.003
"""An axis stands still below this share of its largest speed in all logs."""
PERIODS = 1.0
"""Shortest standstill, in periods of the cutoff; a shorter one is a reversal."""


def at_rest(
    motions: Sequence[MotionEstimate], cutoff_hz: float
) -> tuple[list[MotionEstimate], list[Mask]]:
    """Return the motions with zero speed and acceleration at standstill, and masks of standstill.

    The masks are (n, n_axes). An axis that moves in no log has no speed to compare with, and stays
    unchanged.
    """
    top = np.max([np.abs(m.velocity_rad_s).max(axis=0) for m in motions], axis=0)
    found = [_standing(m, STANDING_SHARE * top, cutoff_hz) for m in motions]
    quiet = [
        replace(
            m,
            velocity_rad_s=np.where(still, 0.0, m.velocity_rad_s),
            acceleration_rad_s2=np.where(still, 0.0, m.acceleration_rad_s2),
        )
        for m, still in zip(motions, found, strict=True)
    ]
    return quiet, found


def _standing(motion: MotionEstimate, slow: Array, cutoff_hz: float) -> Mask:
    """Return a mask (n, n_axes) of speeds that stay below ``slow`` (n_axes,) for the shortest standstill."""
    still = np.abs(motion.velocity_rad_s) < slow
    length = max(2, int(np.ceil(PERIODS / cutoff_hz / motion.sample_time_s)))
    return np.asarray(scipy.ndimage.binary_opening(still, np.ones((length, 1), dtype=np.bool_)))
