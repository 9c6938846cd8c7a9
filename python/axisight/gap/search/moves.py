"""The moves that judge causes anew: which there are, in which order, and where each makes sense.

A new one is a function that changes a state by `SearchState.moved`, an entry here, and its name with what it
does in `axisight.gap.facts.trace.MOVES`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.search.revision import (
    drop_idle,
    finish,
    merge,
    straighten,
    weigh_again,
    withdraw_doubtful,
)
from axisight.gap.search.state import SearchState


@dataclass(frozen=True)
class Context:
    """What a move works with: the fitter, the state that it changes, and the hypotheses ``offered``."""

    fitter: ModelFitter
    state: SearchState
    settings: Settings
    offered: Sequence[Hypothesis] = ()


@dataclass(frozen=True)
class Move:
    """A move: what it is called, and what it does to the state of a context.

    ``in_loops_only``: it makes sense where the errors of axes do not add up, in a closed loop.
    """

    name: str
    run: Callable[[Context], object]
    in_loops_only: bool = False


AFTER_EACH_ROUND = (
    Move("drop", lambda c: drop_idle(c.fitter, c.state, c.settings)),
    Move("merge", lambda c: merge(c.fitter, c.state, c.settings, c.offered)),
)
AT_THE_END = (
    Move("exchange", lambda c: weigh_again(c.fitter, c.state, c.settings), in_loops_only=True),
    Move("straighten", lambda c: straighten(c.fitter, c.state)),
    Move(
        "withdraw", lambda c: withdraw_doubtful(c.fitter, c.state, c.settings), in_loops_only=True
    ),
    Move("finish", lambda c: finish(c.fitter, c.state)),
)


def make(moves: Sequence[Move], context: Context) -> set[str]:
    """Make moves in order; return the labels of the causes that they took out."""
    before = {f.effect.label for f in context.state.model.free}
    for move in moves:
        if not (move.in_loops_only and context.fitter.adds_up):
            move.run(context)
    return before - {f.effect.label for f in context.state.model.free}
