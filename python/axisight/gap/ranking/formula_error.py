"""Causes that are held against one another by little, as whoever writes their formulas leaves little.

Two formulas for one physical effect may differ by a fiftieth of what they explain. Of some effects they do
not: a load is one whoever simulates it. Where one of these leaves next to nothing, another of them that leaves
more than that is not the cause, however small a share of the gap that is.
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

# Next to nothing, as a share of what there is to explain: real machines leave more of any law. And hardly more than
# noise, as a multiple of that.
NEXT_TO_NOTHING = 1e-3
_HARDLY_MORE = 4.0
# By how many times more than for other rivals the difference between effects counts whose right one leaves what is
# white. With four times, a bias by noise of a fortieth of it would be sure.
_WHITE_SURER = 2.0
# Sums of the same residuals in another order.
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
    """Return log-probabilities with candidates of one kind held against one another by little.

    Those of ``axis`` (from 0; None: of all), by what they leave there; of weights those of the arm, too. Together
    they are as probable as they were. On other axes they leave what the rest of the model does. ``losses``: as
    predicted, less than ``least`` by chance; ``likelihood`` of what some of them leave, logarithmic.
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
    """Yield which are of one kind, what the right one of them may leave, and how many times as much it counts.

    Where none of a kind leaves little enough, only those that are held to their error wherever they are tried.
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
    """Make what leaves the very same as one of the members no likelier than it: a deadband as an offset."""
    for i in np.setdiff1d(np.arange(len(losses)), members):
        same = members[np.abs(losses[members] - losses[i]) <= _ROUNDING * losses[i]]
        if len(same):
            logp[i] = min(logp[i], logp[same].max())
