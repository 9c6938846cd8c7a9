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

from axisight.effects import Effect
from axisight.effects.stated import (
    BRISTLES,
    CONSTANT,
    DRY_FRICTION,
    JOINT_SPRING,
    KNEE,
    STIFFER,
    STRIBECK,
)
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
# Speeds at which that is looked for, of the one over which an excess falls.
_LOOKED_AT = np.geomspace(1e-3, 10.0, 200)
# What each law is without what it adds, and by how many times that is likelier then: friction has corners and ways
# too small to show, a cable that pulls like a constant is none.
_PLAINER = {
    BRISTLES[0]: (DRY_FRICTION[0], 10.0),
    STRIBECK[0]: (DRY_FRICTION[0], 10.0),
    JOINT_SPRING[0]: (CONSTANT[0], 50.0),
    KNEE[0]: (STIFFER[0], 10.0),
}
# What each of them adds; of all but Stribeck's an error tells whether it is there.
_ADDED = {BRISTLES[0]: BRISTLES[1:2], JOINT_SPRING[0]: JOINT_SPRING[1:2], KNEE[0]: KNEE[1:]}


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
        plainer, likelier = _PLAINER.get(name, ("", 1.0))
        plain = places.get((plainer, axis))
        if plain is not None and _is_plain(name, fits[i], stretch):
            out[i] = min(out[i], out[plain] - np.log(likelier))
    return out


def _is_plain(name: str, fit: FittedModel, stretch: NDArray[np.int64]) -> bool:
    """Whether a fitted law is no more than its plainer one."""
    if name == STRIBECK[0]:
        return excess_shown(fit.effects[-1]) < _RISES
    return any(own_error(fit, added, stretch) > _UNKNOWN for added in _ADDED[name])


def excess_shown(effect: Effect) -> float:
    """Return by how much Stribeck friction is at most larger than at high speed, of that [1]."""
    dry, excess, speed, corner = ((effect.parameters or {})[name] for name in STRIBECK[1:])
    if dry <= 0:
        return float("inf") if excess > 0 else 0.0
    v = _LOOKED_AT * speed
    friction = (dry + excess * np.exp(-((v / speed) ** 2))) * np.tanh(v / corner)
    return float(friction.max() / dry - 1.0)


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
