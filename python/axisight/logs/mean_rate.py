"""The rate at which irregular stamps are put on a grid when nobody states one."""

from __future__ import annotations

import math

import numpy as np

from axisight.errors import LogError
from axisight.logs.log import Floats

# Stamps that are further off a uniform grid than this share of a step are put on one.
_UNIFORM = 0.01
# A step this many times the usual one is a hole, which nobody should bridge unasked.
_HOLE = 5.0


def mean_rate_hz(time_s: Floats, where: str) -> float | None:
    """Return the mean rate of stamps (n,) [s]; None where they are uniform, or not usable anyway.

    Raises LogError, naming the column ``where`` they stand, for a hole.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.diff(time_s)
    if time_s.size < 3 or not np.all(steps > 0) or not math.isfinite(1.0 / float(np.mean(steps))):
        return None
    usual = float(np.median(steps))
    mean = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    off = np.abs(time_s - time_s[0] - mean * np.arange(time_s.size)).max()
    if off < _UNIFORM * mean:
        return None
    longest = float(np.max(steps))
    if longest > _HOLE * usual:
        raise LogError(
            f"{where}: expected a message every {usual:.4g} s, got a hole of {longest:.4g} s after "
            f"{time_s[int(np.argmax(steps))]:.6g} s; cut the recording there, or bridge it by a column "
            f"map with resample_hz"
        )
    # The mean: single late messages do not count.
    return whole_rate(1.0 / mean)


def whole_rate(rate_hz: float) -> float:
    """Return the whole number nearest to a rate that was measured, where that is within a hundredth."""
    return float(round(rate_hz)) if abs(round(rate_hz) / rate_hz - 1.0) < 0.01 else rate_hz
