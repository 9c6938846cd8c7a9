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
from axisight.effects.stated import ONE_FORMULA
from axisight.gap.fit.fitted_model import Hypothesis

Array = NDArray[np.float64]
Members = NDArray[np.int64]

# Share of the explained error that the right one leaves, on simulated machines of other engines: of delays and
# lags, fitted until they end, one to three ten-thousandths; of laws of friction, where one leaves hardly more
# than noise, half a thousandth; of what changes rigid bodies or their weight, and of constant errors of torque,
# less than a ten-thousandth.
_LAGS, _LAWS, _EXACT = 3e-4, 5e-4, 1e-4
# Next to nothing, as a share of that: real machines leave more of any law. And hardly more than noise: of a
# law of friction that leaves more, it is not known what of it the law leaves.
NEXT_TO_NOTHING = 1e-3
_HARDLY_MORE = 4.0
# By how many times more than for other rivals the difference between lags counts: they are linear in the torque, and
# what is left of the right one is white. With four times, a bias by noise of a fortieth of it would be sure.
_LAGS_SURER = 2.0
# Sums of the same residuals in another order.
_ROUNDING = 1e-9


def held_apart(
    candidates: Sequence[Hypothesis],
    axis: int,
    logp: Array,
    losses: Array,
    explainable: float,
    least: float,
    likelihood: Callable[[Array, Members], Array],
) -> Array:
    """Return log-probabilities with candidates of one kind held against one another by little.

    Those of ``axis`` (from 0), by what they leave there; of weights those of the arm, too. Together they are
    as probable as they were. On other axes they leave what the rest of the model does. ``losses``: as
    predicted, less than ``least`` by chance; ``likelihood`` of what some of them leave, logarithmic.
    """
    out = logp.copy()
    for members, error, surer in _kinds(candidates, axis, losses, explainable, least):
        if len(members) > 1:
            left = np.maximum(losses[members], least) + error * explainable
            sharper = likelihood(left**surer, members)
            out[members] = logp[members].max() + sharper - sharper.max()
            _tie(out, losses, members)
    return out


def _kinds(
    candidates: Sequence[Hypothesis], axis: int, losses: Array, explainable: float, least: float
) -> Iterator[tuple[Members, float, float]]:
    """Yield which are of one kind, what the right one of them may leave, and how many times as much it counts."""
    effects = [c.effect for c in candidates]
    families = np.array([effect_info(e.name).family for e in effects])
    here = np.array([e.axis == axis + 1 for e in effects])
    one = np.array([e.name in ONE_FORMULA and e.axis in (axis + 1, None) for e in effects])

    def leave(kind: NDArray[np.bool_], no_more_than: float) -> bool:
        return bool(losses[kind].min(initial=np.inf) < no_more_than)

    yield np.flatnonzero(here & (families == "timing")), _LAGS, _LAGS_SURER
    friction = here & (families == "friction")
    if leave(friction, _HARDLY_MORE * least):
        yield np.flatnonzero(friction), _LAWS, 1.0
    nothing = leave(one, least + NEXT_TO_NOTHING * explainable)
    yield np.flatnonzero(one if nothing else one & (families == "load")), _EXACT, 1.0


def _tie(logp: Array, losses: Array, members: Members) -> None:
    """Make what leaves the very same as one of the members no likelier than it: a deadband as an offset."""
    for i in np.setdiff1d(np.arange(len(losses)), members):
        same = members[np.abs(losses[members] - losses[i]) <= _ROUNDING * losses[i]]
        if len(same):
            logp[i] = min(logp[i], logp[same].max())
