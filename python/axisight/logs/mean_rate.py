"""The rate for resampling irregular stamps if the user states none."""

from __future__ import annotations

import math

import numpy as np

from axisight.errors import LogError
from axisight.logs.log import Floats

# Stamps further off a uniform grid than this share of a step are resampled.
_UNIFORM = 0.01
# A step of this many median steps is a hole, to be bridged only if the user asks for it.
_HOLE = 5.0
# Steps below this multiple of the median one are those of messages that are late, not of holes.
_LATE = 1.5


def mean_rate_hz(time_s: Floats, where: str) -> float | None:
    """Return the mean rate [Hz] of stamps ``time_s`` (n,) [s]; None if they are uniform or unusable.

    Raises LogError, naming the column ``where``, for a hole.
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
            f"{time_s[int(np.argmax(steps))]:.6g} s; cut the recording there, or bridge it by the line "
            f"resample_hz = {whole_rate(1.0 / without_holes_s(steps)):.6g} in [time] of a column map"
        )
    # The mean over the whole log, because single late messages hardly change it.
    return whole_rate(1.0 / mean)


def without_holes_s(steps_s: Floats) -> float:
    """Return the mean step [s] of stamps with steps ``steps_s`` (n,) [s] that jitter, holes left out."""
    return float(steps_s[steps_s < _LATE * np.median(steps_s)].mean())


def whole_rate(rate_hz: float) -> float:
    """Return the nearest whole number if it is within 1 % of a measured rate [Hz], else the rate itself."""
    return float(round(rate_hz)) if abs(round(rate_hz) / rate_hz - 1.0) < 0.01 else rate_hz
