"""The account that a finished search gives of itself."""

from __future__ import annotations

import math
from collections.abc import Iterator

from axisight.gap.facts.trace import NONE, UNKNOWN, ComparedHypothesis, Comparison, Trace
from axisight.gap.ranking.posterior import AxisPosterior
from axisight.gap.search.state import Round, SearchState

# Hypotheses of an axis that are told, the most probable first.
_TOLD = 8


def trace_of(found: SearchState) -> Trace:
    """Return what a search compared, round by round and axis by axis, and what its moves did."""
    comparisons = (
        _comparison(number, standing, one)
        for number, one in enumerate(found.rounds, start=1)
        for standing in _as_judged(one)
    )
    return Trace(tuple(comparisons), tuple(found.steps), stopped=found.stopped)


def _as_judged(one: Round) -> Iterator[AxisPosterior]:
    """Yield how each axis of a round stood: as what was taken in there was judged, where something was."""
    judged = {standing.axis: standing for _, standing in one.accepted}
    for standing in one.standings:
        yield judged.pop(standing.axis, standing)
    yield from judged.values()


def _comparison(number: int, standing: AxisPosterior, one: Round) -> Comparison:
    told = standing.ranked[:_TOLD]
    labels = {NONE, UNKNOWN, *(r.trial.label for r in told)}
    return Comparison(
        number,
        standing.axis + 1,
        tuple(f.effect.label for f in standing.best.trial.fitted.free[:-1]),
        tuple(
            ComparedHypothesis(r.trial.label, r.probability, r.score, r.trial.cost) for r in told
        ),
        standing.p_none,
        standing.p_unknown,
        tuple(r.trial.label for r, s in one.accepted if s.axis == standing.axis),
        tuple(x for x in standing.ledger if x.hypothesis in labels or math.isinf(x.nats)),
    )
