"""The table of moves that change a set of causes: their order, and when each applies.

To add a move: write a function that proposes sets, add an entry here, and add its name and sentence to
`axisight.gap.facts.trace.MOVES`. Only `axisight.gap.search.contest` decides whether a set is taken.
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
from axisight.gap.search.unsure_size import unsure


@dataclass(frozen=True)
class Move:
    """A move: its name, and the function that proposes sets of causes.

    ``in_loops_only``: only in closed loop, where the errors of the axes do not add up. ``then``: moves that follow if
    this one changed the set.
    """

    name: str
    proposals: Callable[[Context], Iterator[Proposal]]
    in_loops_only: bool = False
    then: tuple[Move, ...] = ()


DROP = Move("drop", needless)
AFTER_EACH_ROUND = (DROP, Move("merge", merged))
AT_THE_END = (
    Move("unsure", unsure, then=(DROP,)),
    Move("exchange", exchanged, in_loops_only=True, then=(DROP,)),
    Move("withdraw", doubtful, in_loops_only=True),
)


def make(moves: Sequence[Move], context: Context) -> set[str]:
    """Make moves in order, each until none of its sets is taken; return the labels of the causes that went out."""
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
    """Take the first proposed set that is likelier than the present one; return whether there is one."""
    labels = frozenset(f.effect.label for f in context.state.model.free)
    for proposal in move.proposals(context):
        # Each set is judged once.
        key = labels - proposal.labels, proposal.labels
        if key in tried:
            continue
        tried.add(key)
        decision = decided(context, proposal)
        if decision is not None:
            _take(move.name, context, proposal, decision)
            return True
    return False


def _take(name: str, context: Context, proposal: Proposal, decision: Decision) -> None:
    """Put a decision into the state: the model and the new posterior."""
    state, standing = context.state, decision.standing
    left, before = state.left(), {f.effect.label for f in state.model.free}
    if standing is not None and proposal.as_entered:
        standing = _as_entered(state, proposal, standing)
    state.moved(name, decision.model)
    # A remaining cause keeps its posterior, with all its rivals.
    if standing is not None and standing.best.trial.label not in before:
        state.rounds.append(Round((standing,), ((standing.best, standing),), left))


def _as_entered(state: SearchState, proposal: Proposal, standing: AxisPosterior) -> AxisPosterior:
    """Return the posterior when the replaced cause was added, led by the effect that replaces it."""
    label = standing.best.trial.label
    for cause, entered in state.accepted:
        if cause.trial.label in proposal.labels:
            same = (r for r in entered.inseparable() if r.trial.label == label)
            return next((entered.led_by(r) for r in same), standing)
    return standing


# Most steps of the last fit.
_FINISHING = 12


def finish(fitter: ModelFitter, state: SearchState) -> None:
    """Continue the fit of the model while a linear step promises a fall of the loss by more than one.

    Fits end at a share of the loss. In a flat valley, such as that of a load and the mass of the link that carries it,
    that share may be several standard deviations.
    """
    model = state.model
    if not model.free or model.stuck or linear_gain(model) < OPEN:
        return
    found = fitter.fit(
        model.free, model, lazy=True, max_iterations=_FINISHING, refreshes=1, worth=OPEN
    )
    if not isinstance(found, Diverged):
        state.moved("finish", found)
