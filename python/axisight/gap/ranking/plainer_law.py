"""Laws that are held to a plainer one, where what they add to it is not there.

Whoever writes dry friction rounds its corner otherwise, over speed or over a small way; a law with a way of its own
takes up the difference, and predicts better by it, as does an excess at standstill that never shows, since the sign
turns over a wider range of speeds. A gear with a knee that nothing reaches, or all pass, is one of another stiffness.
A cable that hardly pulls harder as it is stretched, and is at rest far away,
pulls like a constant. Where the way or the stiffness is real its size is sure, and where the excess is, friction
falls with speed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.effects.friction_curves import rise_over_high_speed
from axisight.effects.relations import Plainer
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import step_without

Array = NDArray[np.float64]

# Standard error of a way or a stiffness, of itself, above which it is not known. Of ways, on machines of three
# engines: up to 0.4, fits that have not ended included, where friction yields; where it does not, the way is at its
# bound or the error two.
_UNKNOWN = 0.5
# By how much of itself friction is larger at some speed than at high speed, where it has an excess: five per
# cent is what another rounding of the corner makes of it.
_RISES = 0.05


def held_to_plainer(
    effects: Sequence[Effect],
    fits: Sequence[FittedModel],
    logp: Array,
    stretch: NDArray[np.int64],
) -> Array:
    """Return log-probabilities (n_fits and others,), of laws that are no more than a plainer one less than its own.

    ``effects``: of candidates, and their ``fits``; ``stretch`` (n_blocks,): the stretch of time of each block.
    """
    out = logp.copy()
    places = {(effect.name, effect.axis): i for i, effect in enumerate(effects)}
    for (name, axis), i in places.items():
        plainer = effect_info(name).plainer
        plain = None if plainer is None else places.get((plainer.law, axis))
        if plainer is not None and plain is not None and _is_plain(plainer, fits[i], stretch):
            out[i] = min(out[i], out[plain] - np.log(plainer.likelier))
    return out


def _is_plain(plainer: Plainer, fit: FittedModel, stretch: NDArray[np.int64]) -> bool:
    """Whether a fitted law is no more than its plainer one."""
    if plainer.by_rise:
        return rise_over_high_speed(fit.effects[-1]) < _RISES
    return any(own_error(fit, added, stretch) > _UNKNOWN for added in plainer.adds)


def own_error(fitted: FittedModel, name: str, stretch: NDArray[np.int64]) -> float:
    """Return the standard error of a parameter of the last effect, of itself: delete-one-stretch jackknife.

    Infinite where it is not fitted, is none, or stands at a bound.
    """
    key = (len(fitted.effects) - 1, name)
    size = abs((fitted.effects[-1].parameters or {})[name])
    groups = np.unique(stretch)
    known = key in fitted.parameters and key not in fitted.at_bound
    if not known or size == 0 or len(groups) < 2:
        return float("inf")
    column = fitted.parameters.index(key)
    moved = np.array([step_without(fitted, stretch == g)[column] for g in groups])
    error = np.sqrt((len(groups) - 1) / len(groups) * float(moved @ moved))
    return float(error / size)
