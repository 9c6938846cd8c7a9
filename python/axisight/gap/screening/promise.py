"""Which candidates are fitted in full, by what one linear step promises of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.screening.screening import Start

Array = NDArray[np.float64]

# Candidates of an axis fitted in full: the best of the screen, and all that come near them.
_FITTED = 4
_NEAR = 0.3
HOPELESS = 0.3
"""A linear step promises less than a fit may gain; this much less of what is worth naming."""
# Candidates fitted where none is worth it.
_LOOKED_AT = 3


def promising(starts: Sequence[Start], worth: Array) -> list[Start]:
    """Return the candidates to fit: at every place the best, where anything is to be gained.

    ``worth`` (n_axes,): what a cause takes away of the loss of an axis at least.
    """
    ranked = sorted(starts, key=lambda s: -s.gain)
    best = best_by_axis(starts, len(worth))
    keep: list[Start] = []
    for axis, least in enumerate(HOPELESS * worth):
        mine = [s for s in ranked if s.option.effect.axis == axis + 1]
        keep += [
            s
            for k, s in enumerate(mine)
            if s.gain > least and (k < _FITTED or (k < 2 * _FITTED and s.gain > _NEAR * best[axis]))
        ]
        keep += [s for s in _at_home(mine, least) if all(s is not k for k in keep)]
    of_the_arm = least_of_the_arm(worth, best)
    keep += [s for s in ranked if s.falls is not None and np.any(s.falls > of_the_arm)]
    # Where nothing is worth a cause, the best of all still say what was looked at.
    return keep or ranked[:_LOOKED_AT]


def _at_home(mine: Sequence[Start], least: float) -> list[Start]:
    """Return the best of an axis by what they gain there, of those that are worth it in all.

    One whose gain lies elsewhere (a link whose weight the axis before it feels) takes no place from them.
    """
    worthy = [start for start in mine if start.gain > least]
    gains = [(start.gain if start.at_home is None else start.at_home, start) for start in worthy]
    ranked = sorted(gains, key=lambda pair: -pair[0])[:_FITTED]
    return [start for gain, start in ranked if gain > _NEAR * ranked[0][0]]


def least_of_the_arm(worth: Array, best: Array) -> Array:
    """Return what an effect of the whole arm has to promise on an axis (n_axes,).

    It has to come near the ``best`` of those of one axis.
    """
    return np.asarray(np.maximum(HOPELESS * worth, _NEAR * best))


def best_by_axis(starts: Sequence[Start], n_axes: int) -> Array:
    """Return the most that a candidate of each axis promises (n_axes,)."""
    best = np.full(n_axes, -np.inf)
    for start in starts:
        if (axis := start.option.effect.axis) is not None:
            best[axis - 1] = max(best[axis - 1], start.gain)
    return np.where(np.isfinite(best), best, 0.0)
