"""Whether the leader of an axis stays the leader when all fits are taken to their end."""

from __future__ import annotations

from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.settling import SETTLED
from axisight.gap.ranking.fitted_hypothesis import are_lags
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

CLOSE = 0.6
"""Share of the leader's score that a rival needs to be fitted again. A better fit does not lift the others enough."""
# Score from which a leader needs no further fit, and the same where no rival is close.
_GOOD_ENOUGH = 0.95
_ALONE = 0.5
# Gain that a fit may still make, as a multiple of the gain that its next linear step predicts.
_STEPS_TO_COME = 3.0


def clear(standing: AxisPosterior) -> bool:
    """Whether the leader stays first after a better fit of it and of its rivals."""
    leader = standing.best
    if len(standing.inseparable()) > 1 or standing.p_unknown > leader.probability:
        return False
    close = [r for r in standing.ranked[1:] if r.score >= CLOSE * leader.score]
    # Rivals with fewer numbers may catch up if their fit has not settled. Lags always may.
    open_ = (
        r for r in close if r.trial.cost < leader.trial.cost or are_lags(r.trial, leader.trial)
    )
    if any(_may_catch_up(r, leader) for r in open_):
        return False
    alone = not close
    return leader.score > (_ALONE if alone else _GOOD_ENOUGH)


def _may_catch_up(one: RankedHypothesis, leader: RankedHypothesis) -> bool:
    """Whether further steps may bring the fit of a rival near the leader."""
    promise = linear_gain(one.trial.fitted) / one.trial.fitted.total
    share_left = (1.0 - one.score) * max(0.0, 1.0 - _STEPS_TO_COME * promise)
    return promise > SETTLED and 1.0 - share_left > _GOOD_ENOUGH * leader.score
