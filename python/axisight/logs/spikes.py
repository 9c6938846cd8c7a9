"""Find spikes: single wrong samples, from bits lost on a bus or sensor glitches."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.logs.log import Floats

# Deviations around one wrong sample, if each sample is compared with the cubic through its four neighbours.
# A step, a corner or a pulse of a real motion gives another pattern (a corner correlates with it by 0.976).
_PATTERN = np.array([1 / 6, -2 / 3, 1.0, -2 / 3, 1 / 6])
_ALIKE = 0.985
# Gaussian noise reaches neither limit. A spike exceeds 15 standard deviations of its neighbourhood, and five
# times the largest deviation of the log, where the top 0.05 % of the samples (at least the ten samples that
# two spikes touch) do not count.
_LOCAL = 15.0
_WHOLE = 5.0
_LARGEST = 0.0005
_TOUCHED = 10
_NEIGHBOURS = 101
# Share of the largest steps below which a spike does no harm; machines make such spikes too.
_SHARE_OF_STEP = 0.02
# More spikes than this belong to the signal, as of a coarse encoder that toggles.
_MOST = 20


def isolated_spikes(values: Floats) -> NDArray[np.int64]:
    """Return the indices of single wrong samples of `values` (n,); empty if there are more than 20."""
    none = np.zeros(0, dtype=np.int64)
    if len(values) < 2 * _NEIGHBOURS:
        return none
    off = np.zeros_like(values)
    off[2:-2] = values[2:-2] - (4 * (values[1:-3] + values[3:-1]) - values[:-4] - values[4:]) / 6
    size = np.abs(off)
    step = _SHARE_OF_STEP * _large(np.abs(np.diff(values)))
    top = np.flatnonzero(size > max(_WHOLE * _large(size), step))
    # The neighbours of a spike are large too; the largest of five is the spike.
    top = top[size[top] >= scipy.ndimage.maximum_filter1d(size, 5)[top]]
    if not 0 < len(top) <= _MOST:
        return none
    return np.array([k for k in top if _is_spike(off, int(k))], dtype=np.int64)


def _large(size: Floats) -> float:
    left_out = max(_LARGEST, _TOUCHED / len(size))
    return float(np.quantile(size, 1.0 - left_out))


def _is_spike(off: Floats, k: int) -> bool:
    if not 2 <= k < len(off) - 2:
        return False
    part = off[k - 2 : k + 3]
    alike = abs(float(part @ _PATTERN)) / float(np.linalg.norm(part) * np.linalg.norm(_PATTERN))
    half = _NEIGHBOURS // 2
    around = np.abs(np.concatenate((off[max(0, k - half) : k - 2], off[k + 3 : k + half])))
    scale = 1.4826 * float(np.median(around))
    return alike > _ALIKE and abs(float(off[k])) > _LOCAL * scale
