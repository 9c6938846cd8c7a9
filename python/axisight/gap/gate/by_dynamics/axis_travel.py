"""Which axes of a log travel enough to tell a sign, a delay or a zero."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.noise import white_std
from axisight.logs import Log
from axisight.logs.quality import quantization

# Travel of an axis in steps of its encoder, or standard deviations of its noise, from which its motion is known. On
# an axis that creeps over a few counts, torque and speed agree by chance.
_TRAVELS = 100.0


def travels(log: Log) -> NDArray[np.bool_]:
    """Return which axes travel enough to be judged, (n_axes,)."""
    steps = [found.step if (found := quantization(x)) else 0.0 for x in log.position_rad.T]
    fine = np.maximum(steps, white_std(log.position_rad, log.sample_time_s))
    return np.asarray(np.ptp(log.position_rad, axis=0) > _TRAVELS * fine)
