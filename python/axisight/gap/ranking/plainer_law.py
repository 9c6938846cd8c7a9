"""Prefers the plainer law where the data do not show what a richer law adds to it.

A richer law can fit small differences between formulas with numbers that mean nothing:

- Presliding and Stribeck friction fit the rounded corner of dry friction.
- A gear with a knee outside the deflections seen is a gear of another stiffness.
- A cable of low stiffness that is stretched far pulls like a constant torque.
- A wave of friction over the position, of an order that the travel does not resolve, is a constant.

If the addition is real, its parameter has a small standard error, or friction falls with speed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.effects.friction_curves import rise_over_high_speed
from axisight.effects.relations import Plainer
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import steps_without_each

Array = NDArray[np.float64]

# Relative standard error above which an added parameter is not known. On machines of three engines it is at most 0.4
# where friction yields before it slips. Where it does not, the parameter is at its bound or the error is about 2.
_UNKNOWN = 0.5
# Least rise of friction at low speed over that at high speed, relative. Another rounding of the corner makes 5 %.
_RISES = 0.05


def held_to_plainer(
    effects: Sequence[Effect],
    fits: Sequence[FittedModel],
    logp: Array,
    stretch: NDArray[np.int64],
) -> Array:
    """Return log-probabilities where a law that adds nothing to its plainer law is less probable than that.

    ``effects``: of the candidates; ``fits``: their fits; ``logp`` (n_fits + 2,); ``stretch`` (n_blocks,): the stretch
    of time of each block.
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
    """Whether the data show nothing of what a fitted law adds to its plainer law."""
    if plainer.by_rise:
        return rise_over_high_speed(fit.effects[-1]) < _RISES
    unknown = [own_error(fit, added, stretch) > _UNKNOWN for added in plainer.adds]
    return all(unknown) if plainer.shown == "either" else any(unknown)


def own_error(fitted: FittedModel, name: str, stretch: NDArray[np.int64]) -> float:
    """Return the relative standard error of a parameter of the last effect, by a delete-one-stretch jackknife.

    Infinite if the parameter is not fitted, is zero, or stands at a bound.
    """
    key = (len(fitted.effects) - 1, name)
    size = abs((fitted.effects[-1].parameters or {})[name])
    groups = np.unique(stretch)
    known = key in fitted.parameters and key not in fitted.at_bound
    if not known or size == 0 or len(groups) < 2:
        return float("inf")
    column = fitted.parameters.index(key)
    moved = steps_without_each(fitted, stretch)[:, column]
    error = np.sqrt((len(groups) - 1) / len(groups) * float(moved @ moved))
    return float(error / size)
