"""Dry friction that yields before it slips, held to plain dry friction where logs do not tell over which way.

Whoever writes dry friction rounds its corner otherwise, over speed or over a small way; a law with a way of its own
takes up the difference, and predicts better by it. Where the way is real its size is sure.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.effects.stated import BRISTLES, DRY_FRICTION
from axisight.gap.evidence import Evidence
from axisight.gap.score import step_without

Array = NDArray[np.float64]

# Standard error of the way, of itself, above which it is not known: on machines of three engines up to 0.4, fits
# that have not ended included, where friction yields; where it does not, the way is at its bound or the error two.
_UNKNOWN = 0.5
# By how many times the law without a way is likelier then.
_USUAL = float(np.log(10.0))


def held_to_dry_friction(
    effects: Sequence[Effect],
    fits: Sequence[Evidence],
    logp: Array,
    stretch: NDArray[np.int64],
) -> Array:
    """Return log-probabilities (n_fits and others,) with laws of an unknown way less likely than without one.

    ``effects``: of candidates, and their ``fits``; ``stretch`` (n_blocks,): the stretch of time of each block.
    """
    out = logp.copy()
    places = {(effect.name, effect.axis): i for i, effect in enumerate(effects)}
    for (name, axis), i in places.items():
        plain = places.get((DRY_FRICTION[0], axis))
        if name != BRISTLES[0] or plain is None:
            continue
        if way_error(fits[i], stretch) > _UNKNOWN:
            out[i] = min(out[i], out[plain] - _USUAL)
    return out


def way_error(evidence: Evidence, stretch: NDArray[np.int64]) -> float:
    """Return the standard error of the way of the last effect, of itself: delete-one-stretch jackknife.

    Infinite where it is not fitted, or stands at a bound.
    """
    key = (len(evidence.effects) - 1, BRISTLES[1])
    groups = np.unique(stretch)
    if key not in evidence.parameters or key in evidence.at_bound or len(groups) < 2:
        return float("inf")
    column = evidence.parameters.index(key)
    moved = np.array([step_without(evidence, stretch == g)[column] for g in groups])
    error = np.sqrt((len(groups) - 1) / len(groups) * float(moved @ moved))
    return float(error / abs((evidence.effects[-1].parameters or {})[BRISTLES[1]]))
