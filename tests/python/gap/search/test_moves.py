"""The moves of the search: made in order, where they make sense, as long as one of their sets is taken."""

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect
from axisight.gap import Settings
from axisight.gap.facts.trace import MOVES
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search import moves
from axisight.gap.search.contest import Context, Decision, Proposal
from axisight.gap.search.moves import AFTER_EACH_ROUND, AT_THE_END, Move, make
from gap_data import StateStub


def cause(name: str) -> Hypothesis:
    return Hypothesis(Effect(name, 1), ())


PLAY, DRAG, OFFSET = map(cause, ("backlash", "quadratic_drag", "torque_offset"))


def test_every_move_has_a_name_and_a_sentence():
    names = [move.name for move in (*AFTER_EACH_ROUND, *AT_THE_END)]
    assert len(set(names)) == len(names)
    assert set(names) <= MOVES.keys()


class Search:
    """A search of which sets without some effects are likelier; ``asked`` has what was decided."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, out: set[str], *, adds_up: bool = False):
        self.asked: list[str] = []
        self.state = StateStub(
            model=SimpleNamespace(free=[PLAY, DRAG, OFFSET]), left=lambda: None, rounds=[]
        )
        self.context = Context(SimpleNamespace(adds_up=adds_up), self.state, Settings())  # type: ignore[arg-type]

        def decided(context: Context, proposal: Proposal) -> Decision | None:
            (label,) = proposal.labels
            self.asked.append(label)
            rest = [f for f in context.state.model.free if f.effect.label != label]
            return Decision(SimpleNamespace(free=rest), None) if label in out else None  # type: ignore[arg-type]

        monkeypatch.setattr(moves, "decided", decided)


def each(context: Context) -> Iterator[Proposal]:
    for f in context.state.model.free:
        yield Proposal(0, (f,), or_none="needless")


def test_a_move_is_made_again_as_long_as_one_of_its_sets_is_taken(monkeypatch):
    found = Search(monkeypatch, {"backlash@1", "torque_offset@1"})
    assert make([Move("drop", each)], found.context) == {"backlash@1", "torque_offset@1"}
    assert [f.effect.label for f in found.state.model.free] == ["quadratic_drag@1"]


def test_the_same_set_is_judged_once_beside_the_same_others(monkeypatch):
    found = Search(monkeypatch, set())

    def twice(context: Context) -> Iterator[Proposal]:
        yield from each(context)
        yield from each(context)

    assert make([Move("drop", twice)], found.context) == set()
    assert found.asked == ["backlash@1", "quadratic_drag@1", "torque_offset@1"]


@pytest.mark.parametrize(("adds_up", "made"), [(False, 3), (True, 0)])
def test_moves_of_loops_are_made_in_loops_only(adds_up: bool, made: int, monkeypatch):
    found = Search(monkeypatch, set(), adds_up=adds_up)
    make([Move("drop", each, in_loops_only=True)], found.context)
    assert len(found.asked) == made


@pytest.mark.parametrize("out", [set(), {"backlash@1"}])
def test_what_follows_a_move_is_made_where_that_changed_something(out: set[str], monkeypatch):
    found = Search(monkeypatch, out)
    followed: list[int] = []

    def after(context: Context) -> Iterator[Proposal]:
        followed.append(len(context.state.model.free))
        return iter(())

    make([Move("exchange", each, then=(Move("drop", after),))], found.context)
    assert followed == ([2] if out else [])


def ranked(one: Hypothesis, probability: float) -> RankedHypothesis:
    trial = FittedHypothesis(one, SimpleNamespace(free=(one,)), np.zeros(1))  # type: ignore[arg-type]
    return RankedHypothesis(trial, 0.9, 1.0, 9.0, probability)


def taken(new: Hypothesis, *, as_entered: bool) -> StateStub:
    """A state after one effect has taken the place of play that stood beside a drag as it came in."""
    came_in = AxisPosterior(0, (ranked(PLAY, 0.6), ranked(DRAG, 0.4)), 0.0, 0.0)
    state = StateStub(
        model=SimpleNamespace(free=[PLAY, OFFSET]),
        left=lambda: np.array([5.0]),
        rounds=[],
        accepted=[(came_in.best, came_in), (ranked(OFFSET, 1.0), came_in)],
    )
    context = Context(None, state, Settings())  # type: ignore[arg-type]
    standing = AxisPosterior(0, (ranked(new, 1.0),), 0.0, 0.0)
    model = SimpleNamespace(free=[new])
    moves._take(
        "merge", context, Proposal(0, (PLAY,), as_entered=as_entered), Decision(model, standing)
    )  # type: ignore[arg-type]
    assert state.model is model
    return state


@pytest.mark.parametrize(("as_entered", "rivals"), [(True, 2), (False, 1)])
def test_what_takes_a_place_stands_as_the_contest_or_the_round_had_it(
    as_entered: bool, rivals: int
):
    (added,) = taken(DRAG, as_entered=as_entered).rounds
    ((cause, standing),) = added.accepted
    assert cause.trial.label == "quadratic_drag@1" == standing.best.trial.label
    assert len(standing.ranked) == rivals
    assert added.left.tolist() == [5.0]


def test_one_of_the_causes_that_does_it_alone_stands_as_it_did():
    assert taken(OFFSET, as_entered=False).rounds == []
