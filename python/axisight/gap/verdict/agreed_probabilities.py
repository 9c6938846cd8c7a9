"""Probabilities that agree with a verdict that counts more than the comparison of hypotheses.

The comparison sees the estimation logs alone. The verdict also counts the validation logs, the scatter of simulators
and how much a cause must explain. Where it says *none* or *unknown*, that hypothesis therefore leads.
"""

from __future__ import annotations

from dataclasses import replace

from axisight.gap.facts.result import Candidate
from axisight.gap.facts.trace import NONE, UNKNOWN, Adjustment, log_odds
from axisight.gap.ranking.posterior import TINY
from axisight.gap.verdict.conclusion import Conclusion

# Least probability of *none* or *unknown* where it is the verdict.
_LEAST = 0.95


def in_agreement(conclusion: Conclusion) -> Conclusion:
    """Return the conclusion with probabilities that agree with its verdict; of causes they stay as they are.

    With the verdict *none*, the excess counts as scatter, so *none* takes over the probability of *unknown*.
    """
    if conclusion.verdict == "none":
        return _led_by_none(conclusion)
    if conclusion.verdict != "unknown" or conclusion.p_unknown >= _LEAST:
        return conclusion
    rest = _rest(conclusion.p_unknown)
    entry = _raised(UNKNOWN, conclusion.p_unknown, _LEAST, rest)
    return replace(
        _scaled(conclusion, rest),
        p_none=rest * conclusion.p_none,
        p_unknown=_LEAST,
        ledger=(*conclusion.ledger, entry),
    )


def _led_by_none(conclusion: Conclusion) -> Conclusion:
    scatter = conclusion.p_none + conclusion.p_unknown
    kept = max(scatter, _LEAST)
    rest = _rest(scatter) if kept > scatter else 1.0
    entries = []
    if conclusion.p_unknown > 0:
        entries.append(Adjustment("verdict", UNKNOWN, log_odds(0.0)))
    if kept != conclusion.p_none:
        entries.append(_raised(NONE, conclusion.p_none, kept, rest))
    return replace(
        _scaled(conclusion, rest),
        p_none=kept,
        p_unknown=0.0,
        ledger=(*conclusion.ledger, *entries),
    )


def _raised(hypothesis: str, before: float, after: float, rest: float) -> Adjustment:
    """Return the entry of a hypothesis whose probability rises while that of the others falls by a factor ``rest``."""
    odds = after / (max(before, TINY) * max(rest, TINY))
    return Adjustment("verdict", hypothesis, log_odds(odds))


def _rest(leader: float) -> float:
    """Return the factor of all other probabilities if the leader's rises to the least that it may have."""
    return (1.0 - _LEAST) / max(1.0 - leader, TINY)


def _scaled(conclusion: Conclusion, times: float) -> Conclusion:
    def scaled(of: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        return tuple(replace(c, probability=times * c.probability) for c in of)

    return replace(
        conclusion,
        ranking=scaled(conclusion.ranking),
        alternatives=scaled(conclusion.alternatives),
    )
