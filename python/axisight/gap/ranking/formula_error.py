"""Smaller formula error for effects with one accepted formula: rigid bodies, delays, friction laws.

Two formulas of one effect may differ by 2 % of what they explain. A rigid load has only one formula. If one effect
of such a kind leaves almost no error, its rivals of the same kind that leave more become improbable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.effects.relations import FORMULA_KINDS
from axisight.gap.fit.fitted_model import Hypothesis

Array = NDArray[np.float64]
Members = NDArray[np.int64]

# Almost no error, as a share of what there is to explain: on real machines every law leaves more. And close to the
# noise, as a multiple of its loss.
NEXT_TO_NOTHING = 1e-3
_HARDLY_MORE = 4.0
# Weight of a loss difference between effects whose true one leaves white noise. With a weight of four, a bias of
# 1/40 of the noise would count as certain.
_WHITE_SURER = 2.0
# Rounding of sums over the same residuals in another order.
_ROUNDING = 1e-9


def held_apart(
    candidates: Sequence[Hypothesis],
    axis: int | None,
    logp: Array,
    losses: Array,
    explainable: float,
    least: float,
    likelihood: Callable[[Array, Members], Array],
) -> Array:
    """Return log-probabilities (n_candidates + 2,) where candidates of one kind compete by their own formula error.

    Only candidates that act on ``axis`` (from 0; None: on all) or on the arm compete. Their total probability stays.
    ``losses``: held-out losses; ``least``: the loss of noise; ``explainable``: loss above noise without a candidate;
    ``likelihood``: log-likelihood of some losses for the members with these indices.
    """
    out = logp.copy()
    for members, error, surer in _kinds(candidates, axis, losses, explainable, least):
        left = np.maximum(losses[members], least) + error * explainable
        sharper = likelihood(left**surer, members)
        out[members] = logp[members].max() + sharper - sharper.max()
        _tie(out, losses, members)
    return out


def _kinds(
    candidates: Sequence[Hypothesis],
    axis: int | None,
    losses: Array,
    explainable: float,
    least: float,
) -> Iterator[tuple[Members, float, float]]:
    """Yield the members of each kind, the error that their formula may leave, and the weight of a difference.

    If no member comes near enough to the noise, only members whose formula is always exact are yielded.
    """
    effects = [c.effect for c in candidates]
    formulas = [effect_info(e.name).formula for e in effects]
    here = np.array([axis is None or e.axis in (axis + 1, None) for e in effects], dtype=bool)
    always = np.array([f.held == "always" for f in formulas], dtype=bool)
    little = {
        "always": np.inf,
        "near_noise": _HARDLY_MORE * least,
        "next_to_nothing": least + NEXT_TO_NOTHING * explainable,
    }
    for kind in FORMULA_KINDS:
        members = np.flatnonzero(here & np.array([f.kind == kind for f in formulas], dtype=bool))
        enough = min((little[formulas[i].held] for i in members), default=0.0)
        if losses[members].min(initial=np.inf) >= enough:
            members = members[always[members]]
        if len(members) > 1:
            formula = formulas[members[0]]
            yield members, formula.error, _WHITE_SURER if formula.white else 1.0


def _tie(logp: Array, losses: Array, members: Members) -> None:
    """Limit a candidate with exactly the loss of a member to that member's log-probability.

    Example: a deadband that acts as an offset.
    """
    for i in np.setdiff1d(np.arange(len(losses)), members):
        same = members[np.abs(losses[members] - losses[i]) <= _ROUNDING * losses[i]]
        if len(same):
            logp[i] = min(logp[i], logp[same].max())
