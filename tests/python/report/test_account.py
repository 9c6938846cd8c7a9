"""The account of a verdict: what was compared, why rivals lost, what each move did."""

import math
from dataclasses import replace

from axisight.gap.facts.trace import (
    NONE,
    UNKNOWN,
    Adjustment,
    ComparedHypothesis,
    Comparison,
    Step,
    Trace,
)
from axisight.gap.facts.wording import removed_in_words
from axisight.report.account import account

PLAY, STIFF = "backlash@1", "piecewise_stiffness@1"


def comparison(*, taken: tuple[str, ...], axis: int = 1) -> Comparison:
    ledger = (
        Adjustment("likelihood", PLAY, 12.0),
        Adjustment("likelihood", STIFF, 11.0),
        Adjustment("cost", PLAY, -4.0),
        Adjustment("cost", STIFF, -6.0),
        Adjustment("not_a_cause", "torque_offset@1", -math.inf),
    )
    hypotheses = (
        ComparedHypothesis(PLAY, 0.95, 0.999, 2.0),
        ComparedHypothesis(STIFF, 0.95 * math.exp(-3.0), 0.97, 3.0),
    )
    return Comparison(1, axis, (), hypotheses, 1e-30, 0.0, taken, ledger)


def test_the_first_is_told_and_rivals_say_by_how_much_and_by_what_they_lost():
    ((first, rivals),) = account(Trace((comparison(taken=(PLAY,)),))).comparisons
    assert first == (
        "round 1, axis 1: first of 2 is backlash@1, p = 0.950, explains 99.9 % of the gap there on "
        "left-out data; taken in: backlash@1."
    )
    assert rivals[0] == f"{STIFF} behind by 3.0 nats: likelihood -1.0, cost -2.0."
    assert rivals[1].startswith(f"{NONE} behind by more than 21 nats: likelihood -12.0, cost +4.0")
    assert rivals[2].startswith(f"{UNKNOWN} behind by more than 21 nats")
    assert rivals[3].startswith("torque_offset@1 taken out: It is too small")


def test_axes_without_a_cause_are_told_only_where_none_was_found():
    both = Trace((comparison(taken=(PLAY,)), comparison(taken=(), axis=2)))
    assert len(account(both).comparisons) == 1
    neither = Trace((comparison(taken=()), comparison(taken=(), axis=2)))
    told = account(neither).comparisons
    assert len(told) == 2
    assert all("nothing taken in" in first for first, _ in told)


def test_moves_say_what_came_and_went_and_what_it_did_to_the_loss():
    steps = (
        Step("add", (), (STIFF,), 1000.0, 10.0),
        Step("exchange", (STIFF,), (PLAY,), 10.0, 9.0),
        Step("finish", (PLAY,), (PLAY,), 9.0, 8.5),
    )
    moves = account(Trace((), steps)).moves
    assert moves[0].startswith("move 1, add: + piecewise_stiffness@1; loss 1000 to 10. Added")
    assert moves[1].startswith(
        "move 2, exchange: + backlash@1, - piecewise_stiffness@1; loss 10 to 9."
    )
    assert moves[2].startswith("move 3, finish: same causes; loss 9 to 8.5.")


def test_a_cause_that_shares_its_probability_says_with_what():
    halved = Trace((), (), (Adjustment("either", PLAY, math.log(0.5)),))
    told = account(halved)
    assert told.named == ("backlash@1, once named: either -0.7.",)
    assert told.rules == ("either: Another cause gives the same logs and is equally likely.",)


def test_an_empty_trace_has_an_empty_account():
    assert list(account(Trace()).lines()) == []


def test_an_axis_without_a_gap_has_no_share_of_it():
    """Next to nothing above noise makes any share of it a huge number."""
    whole = comparison(taken=())
    first = replace(whole.hypotheses[0], score=3.1e11)
    ((told, _),) = account(Trace((replace(whole, hypotheses=(first,)),))).comparisons
    assert "first of 1 is backlash@1, p = 0.950, where the axis is at its floor" in told
    assert removed_in_words(3.1e11) == "at its floor"
    assert removed_in_words(0.985) == "98.5 %"
