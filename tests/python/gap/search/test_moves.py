"""The moves of the search: made in order, where they make sense, each by a name that says what it does."""

from types import SimpleNamespace

import pytest

from axisight.gap import Settings
from axisight.gap.facts.trace import MOVES
from axisight.gap.search.moves import AFTER_EACH_ROUND, AT_THE_END, Context, Move, make


def labelled(*labels: str) -> SimpleNamespace:
    return SimpleNamespace(free=[SimpleNamespace(effect=SimpleNamespace(label=x)) for x in labels])


def test_every_move_has_a_name_and_a_sentence():
    names = [move.name for move in (*AFTER_EACH_ROUND, *AT_THE_END)]
    assert len(set(names)) == len(names)
    assert set(names) <= MOVES.keys()


@pytest.mark.parametrize(("adds_up", "made"), [(False, ["a", "b"]), (True, ["b"])])
def test_moves_are_made_in_order_where_they_make_sense(adds_up: bool, made: list[str]):
    done: list[str] = []
    state = SimpleNamespace(model=labelled("backlash@1", "payload"))

    def dropped(context: Context) -> None:
        done.append("b")
        context.state.model = labelled("payload")

    moves = [Move("a", lambda _: done.append("a"), in_loops_only=True), Move("b", dropped)]
    context = Context(SimpleNamespace(adds_up=adds_up), state, Settings())
    assert make(moves, context) == {"backlash@1"}
    assert done == made
