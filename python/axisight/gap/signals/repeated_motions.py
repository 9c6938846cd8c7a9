"""Finds repeated motions in logs: no model explains the difference between repeats."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.motion import Filtering, Motion, motion
from axisight.logs import Log

Array = NDArray[np.float64]

# Largest rms difference of the positions of repeats, as a share of an axis' range. Controllers repeat a motion
# to 0.1 %.
_SAME = 0.01
# Largest rms difference of their speeds, as a share of the range. Multisines on one square wave have similar
# positions; only their speeds, which have more noise, tell them apart.
_SAME_SPEED = 0.02


def repeated_std_nm(logs: Sequence[Log], filtering: Filtering) -> Array | None:
    """Return the standard deviation (n_axes,) [Nm] of the low-passed torque between repeats; None without repeats.

    Repeats are logs of one motion, and the periods of a periodic log.
    """
    groups: list[list[Motion]] = []
    for log in logs:
        whole = motion(log, filtering.cutoff_hz, filtering.measured)
        for piece in _periods(log, whole):
            mine = next((g for g in groups if _same(g[0], piece)), None)
            if mine is None:
                groups.append([piece])
            else:
                mine.append(piece)
    squares, freedom = np.zeros(logs[0].n_axes), 0
    for group in groups:
        torques = np.array([piece[3] for piece in group])
        squares += ((torques - torques.mean(axis=0)) ** 2).mean(axis=1).sum(axis=0)
        freedom += len(group) - 1
    return np.asarray(np.sqrt(squares / freedom)) if freedom else None


def _periods(log: Log, whole: Motion) -> list[Motion]:
    """Return the periods of a motion, or the whole motion if it has fewer than three.

    The first period is left out, since the motion may still settle.
    """
    length = 0 if log.period_s is None else round(log.period_s / log.sample_time_s)
    count = log.n_samples // length if length else 0
    if count < 3:
        return [whole]
    cut = (slice(i * length, (i + 1) * length) for i in range(1, count))
    return [(whole[0][p], whole[1][p], whole[2][p], whole[3][p]) for p in cut]


def _same(one: Motion, other: Motion) -> bool:
    if one[0].shape != other[0].shape:
        return False
    return _alike(one[0], other[0], _SAME) and _alike(one[1], other[1], _SAME_SPEED)


def _alike(one: Array, other: Array, share: float) -> bool:
    """Whether two signals (n, n_axes) differ by less than a share of their range on every axis."""
    allowed = share * np.maximum(np.ptp(one, axis=0), 1e-12)
    return bool(np.all(np.sqrt(np.mean((one - other) ** 2, axis=0)) <= allowed))
