"""Whether what leads an axis does so whatever better fits make of it and its rivals."""

from __future__ import annotations

from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.settling import SETTLED
from axisight.gap.ranking.fitted_hypothesis import are_lags
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

CLOSE = 0.6
"""Share of the first one's score that a rival needs to be refined: a fit of its own does not make more of the rest."""
# One that explains nearly everything, or most of it with none other close, is taken as it is.
_GOOD_ENOUGH = 0.95
_ALONE = 0.5
# A fit that has not settled may gain so many times what its next step promises.
_STEPS_TO_COME = 3.0


def clear(standing: AxisPosterior) -> bool:
    """Whether the first leads whatever a better fit makes of it."""
    leader = standing.best
    if len(standing.inseparable()) > 1 or standing.p_unknown > leader.probability:
        return False
    close = [r for r in standing.ranked[1:] if r.score >= CLOSE * leader.score]
    # What needs fewer numbers may catch up where its fit has not settled; and of lags every one.
    open_ = (
        r for r in close if r.trial.cost < leader.trial.cost or are_lags(r.trial, leader.trial)
    )
    if any(_may_catch_up(r, leader) for r in open_):
        return False
    alone = not close
    return leader.score > (_ALONE if alone else _GOOD_ENOUGH)


def _may_catch_up(one: RankedHypothesis, leader: RankedHypothesis) -> bool:
    """Whether steps from where the fit of a rival ended may bring it near the leader."""
    promise = linear_gain(one.trial.fitted) / one.trial.fitted.total
    share_left = (1.0 - one.score) * max(0.0, 1.0 - _STEPS_TO_COME * promise)
    return promise > SETTLED and 1.0 - share_left > _GOOD_ENOUGH * leader.score
