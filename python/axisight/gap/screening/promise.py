"""Selects the hypotheses that get a full fit, by the gain that one linear step predicts for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.screening.screening import Start

Array = NDArray[np.float64]

# Candidates of one axis that get a full fit: the best four, and up to eight whose predicted gain is above 0.3 of the
# best.
_FITTED = 4
_NEAR = 0.3
HOPELESS = 0.3
"""Screening threshold, as a share of the smallest fall for a cause: one step predicts less than a fit gains."""
# Candidates that get a full fit if none reaches the threshold.
_LOOKED_AT = 3


def promising(starts: Sequence[Start], worth: Array) -> list[Start]:
    """Return the candidates that get a full fit: on each axis the best of those above the screening threshold.

    Without any such candidate, the best three of all are returned. ``worth`` (n_axes,): smallest fall of an axis's loss
    that a cause must bring.
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
        keep += [s for s in _best_at_home(mine, least) if all(s is not k for k in keep)]
    of_the_arm = least_of_the_arm(worth, best)
    keep += [s for s in ranked if s.falls is not None and np.any(s.falls > of_the_arm)]
    # If no candidate reaches the threshold, the report still names the best ones that were tried.
    return keep or ranked[:_LOOKED_AT]


def _best_at_home(mine: Sequence[Start], least: float) -> list[Start]:
    """Return the best candidates of an axis by their gain on that axis.

    Only candidates whose total gain is above the threshold ``least`` take part. The next axis may gain most from a
    candidate: a link's weight also loads the axis before it. Such a candidate must not displace those that explain the
    axis itself.
    """
    worthy = [start for start in mine if start.gain > least]
    gains = [(start.gain if start.at_home is None else start.at_home, start) for start in worthy]
    ranked = sorted(gains, key=lambda pair: -pair[0])[:_FITTED]
    return [start for gain, start in ranked if gain > _NEAR * ranked[0][0]]


def least_of_the_arm(worth: Array, best: Array) -> Array:
    """Return the gain that an effect of the whole arm must promise on an axis (n_axes,).

    ``worth``: smallest fall that a cause must bring; ``best``: best gain of a candidate that acts on that axis alone.
    """
    return np.asarray(np.maximum(HOPELESS * worth, _NEAR * best))


def best_by_axis(starts: Sequence[Start], n_axes: int) -> Array:
    """Return the largest gain that a candidate of each axis promises (n_axes,), zero without candidates."""
    best = np.full(n_axes, -np.inf)
    for start in starts:
        if (axis := start.option.effect.axis) is not None:
            best[axis - 1] = max(best[axis - 1], start.gain)
    return np.where(np.isfinite(best), best, 0.0)
