"""Stretches in which an axis stands still while others move.

There friction is anything between its bounds, and the sign of the speed is that of the noise: the
rows of the axis say nothing of its friction, and a turn of the noise is no reversal.
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
"""Speed below which an axis stands, as a share of its largest speed in all logs."""
PERIODS = 1.0
"""Periods of the cutoff that a standstill lasts: less is a reversal."""


def at_rest(
    motions: Sequence[MotionEstimate], cutoff_hz: float
) -> tuple[list[MotionEstimate], list[Mask]]:
    """Return the motions with speed and acceleration zero where an axis stands, and where it does.

    The masks are (n, n_axes). An axis that moves in no log has no speed to compare with, and is left
    as it is.
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
    """Return where speeds stay below ``slow`` (n_axes,) for as long as the filter needs, (n, n_axes)."""
    still = np.abs(motion.velocity_rad_s) < slow
    length = max(2, int(np.ceil(PERIODS / cutoff_hz / motion.sample_time_s)))
    return np.asarray(scipy.ndimage.binary_opening(still, np.ones((length, 1), dtype=np.bool_)))
