"""The moves that judge causes anew: which there are, in which order, and where each makes sense.

A new one is a function that proposes other sets of causes, an entry here, and its name with what it does in
`axisight.gap.facts.trace.MOVES`. Whether a set is taken is decided in `axisight.gap.search.contest` alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.posterior import AxisPosterior
from axisight.gap.search.contest import Context, Decision, Proposal, decided
from axisight.gap.search.needless import doubtful, needless
from axisight.gap.search.one_for_several import merged
from axisight.gap.search.rivals import exchanged
from axisight.gap.search.state import OPEN, Round, SearchState


@dataclass(frozen=True)
class Move:
    """A move: what it is called, and which sets it proposes in a context.

    ``in_loops_only``: it makes sense where the errors of axes do not add up, in a closed loop. ``then``: moves that
    follow where it changed something.
    """

    name: str
    proposals: Callable[[Context], Iterator[Proposal]]
    in_loops_only: bool = False
    then: tuple[Move, ...] = ()


DROP = Move("drop", needless)
AFTER_EACH_ROUND = (DROP, Move("merge", merged))
AT_THE_END = (
    Move("exchange", exchanged, in_loops_only=True, then=(DROP,)),
    Move("withdraw", doubtful, in_loops_only=True),
)


def make(moves: Sequence[Move], context: Context) -> set[str]:
    """Make moves in order, each as long as one of its sets is taken; return the labels of causes that went out."""
    before = {f.effect.label for f in context.state.model.free}
    for move in moves:
        if move.in_loops_only and context.fitter.adds_up:
            continue
        tried: set[tuple[frozenset[str], frozenset[str]]] = set()
        changed = False
        while _made(move, context, tried):
            changed = True
        if changed:
            make(move.then, context)
    return before - {f.effect.label for f in context.state.model.free}


def _made(move: Move, context: Context, tried: set[tuple[frozenset[str], frozenset[str]]]) -> bool:
    """Take the first set of a move that is likelier than what there is; return whether there is one."""
    labels = frozenset(f.effect.label for f in context.state.model.free)
    for proposal in move.proposals(context):
        # The same causes beside the same others were judged before.
        key = labels - proposal.labels, proposal.labels
        if key in tried:
            continue
        tried.add(key)
        decision = decided(context, proposal)
        if decision is not None and _taken(move.name, context, proposal, decision):
            return True
    return False


def _taken(name: str, context: Context, proposal: Proposal, decision: Decision) -> bool:
    """Take a set of causes into the state, with how what is new in it stood; return whether it is another set."""
    state, standing = context.state, decision.standing
    if decision.model is state.model:
        if standing is not None:
            state.judged_again(standing)
        return False
    left, before = state.left(), {f.effect.label for f in state.model.free}
    if standing is not None and proposal.as_entered:
        standing = _as_entered(state, proposal, standing)
    state.moved(name, decision.model)
    # What was a cause before, and does it alone now, stands as it did, with all its rivals.
    if standing is not None and standing.best.trial.label not in before:
        state.rounds.append(Round((standing,), ((standing.best, standing),), left))
    return True


def _as_entered(state: SearchState, proposal: Proposal, standing: AxisPosterior) -> AxisPosterior:
    """Return what takes the place of a cause as it stood beside that; there it had all its rivals."""
    label = standing.best.trial.label
    for cause, entered in state.accepted:
        if cause.trial.label in proposal.labels:
            same = (r for r in entered.inseparable() if r.trial.label == label)
            return next((entered.led_by(r) for r in same), standing)
    return standing


# Steps of the last fit.
_FINISHING = 12


def finish(fitter: ModelFitter, state: SearchState) -> None:
    """Fit on where a step still promises more than noise leaves open.

    A share of a large loss, at which fits end, may be many standard deviations along a flat valley, such
    as that of a load and the mass of the link that carries it.
    """
    model = state.model
    if not model.free or model.stuck or linear_gain(model) < OPEN:
        return
    found = fitter.fit(
        model.free, model, lazy=True, max_iterations=_FINISHING, refreshes=1, worth=OPEN
    )
    if not isinstance(found, Diverged):
        state.moved("finish", found)
