"""The ledger: what it says of each hypothesis adds up to its probability."""

import ast
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_posterior import CURRENT, a_trial, standing

from axisight.gap.facts.trace import MOVES, NONE, RULES, UNKNOWN
from axisight.gap.ranking.belief import Belief
from axisight.gap.ranking.posterior import AxisPosterior


def said(found: AxisPosterior, label: str) -> float:
    return sum(entry.nats for entry in found.ledger if entry.hypothesis == label)


def assert_adds_up(found: AxisPosterior) -> None:
    """Differences of log-probabilities are those of what the ledger says, of all that are left."""
    probabilities = {r.trial.label: r.probability for r in found.ranked}
    probabilities |= {NONE: found.p_none, UNKNOWN: found.p_unknown}
    first = found.best.trial.label
    for label, p in probabilities.items():
        if p > 0:
            apart = math.log(p / probabilities[first])
            assert said(found, label) - said(found, first) == pytest.approx(apart, abs=1e-9)
    assert sum(probabilities.values()) == pytest.approx(1.0)


def three() -> AxisPosterior:
    """Three candidates that stand close, one of them elsewhere."""
    return standing(
        [
            a_trial("coulomb_friction", 2, np.full(40, 1.1)),
            a_trial("asymmetric_friction", 3, np.full(40, 1.09)),
            a_trial("viscous_friction", 1, np.full(40, 1.2), axis=2),
        ]
    )


def test_likelihood_cost_and_rules_of_a_round_add_up():
    found = three()
    assert {"likelihood", "cost"} <= {entry.rule for entry in found.ledger}
    assert_adds_up(found)


TIMES = st.floats(1e-3, 1e3)
CHANGES = st.one_of(
    st.tuples(st.just("adjusted"), st.integers(0, 2), TIMES),
    st.tuples(st.just("exchanged"), st.integers(1, 2), TIMES),
    st.tuples(st.just("joined"), st.integers(1, 2), TIMES),
    st.tuples(st.just("without"), st.integers(1, 2), TIMES),
)


@given(st.lists(CHANGES, max_size=6))
def test_whatever_changes_a_probability_writes_it_down(changes):
    found = three()
    for how, place, times in changes:
        one = found.ranked[min(place, len(found.ranked) - 1)]
        if how == "adjusted":
            found = found.adjusted("look_alike", {one.trial.label: times})
        elif one is not found.best and how == "exchanged":
            found = found.exchanged("play_of_gear", one)
        elif one is not found.best and how == "joined":
            found = found.joined(one, [found.best, one])
        elif one is not found.best:
            found = found.without(one.trial.label)
        assert_adds_up(found)


def test_other_axes_hold_a_rival_by_what_they_say():
    here = three()
    elsewhere = standing(
        [
            a_trial("coulomb_friction", 2, np.full(40, 1.1)),
            a_trial("asymmetric_friction", 3, np.full(40, 3.0)),
        ]
    )
    assert_adds_up(here.with_axes_it_leads([elsewhere]))
    assert_adds_up(here.with_axes_rivals_lead([elsewhere]))


def test_a_rival_that_does_nothing_elsewhere_is_out_of_question_and_still_told():
    elsewhere = standing([a_trial("coulomb_friction", 2, np.full(40, 1.1))])
    held = three().with_axes_it_leads([elsewhere])
    assert len(held.ranked) == 3
    assert [r.probability for r in held.ranked[1:]] == [0.0, 0.0]
    assert_adds_up(held)


def test_a_belief_keeps_no_entry_of_what_changes_nothing():
    belief = Belief(["a", "b"])
    belief.becomes("likelihood", np.array([3.0, 1.0]), against=1.0)
    belief.becomes("cost", np.array([3.0, 1.0]))
    assert [(e.rule, e.hypothesis, e.nats) for e in belief.ledger] == [("likelihood", "a", 2.0)]
    odds = np.exp(2.0)
    assert belief.probabilities() == pytest.approx([odds / (1 + odds), 1 / (1 + odds)])


def test_an_entry_names_a_rule_and_a_step_a_move_with_a_reason(repository: Path):
    calls = {"adjusted": RULES, "becomes": RULES, "exchanged": RULES, "moved": MOVES}
    seen = set()
    for path in (repository / "python" / "axisight" / "gap").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            move = isinstance(node.func, ast.Name) and node.func.id == "Move"
            known = MOVES if move else calls.get(getattr(node.func, "attr", ""))
            first = node.args[0] if node.args else None
            if known is not None and isinstance(first, ast.Constant):
                assert first.value in known, f"{path}:{node.lineno}"
                seen.add(first.value)
    assert seen >= set(MOVES)


def test_only_the_posterior_makes_a_probability_of_one(repository: Path):
    """No other file of the rooms that search writes a probability of a candidate."""
    rooms = repository / "python" / "axisight" / "gap"
    for room in ("screening", "search", "hypotheses", "fit"):
        for path in (rooms / room).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                written = isinstance(node, ast.keyword) and node.arg == "probability"
                assert not written, f"{path}:{node.value.lineno}"


def test_a_gap_that_nothing_explains_has_none_and_unknown_in_its_ledger():
    found = standing([a_trial("viscous_friction", 1, CURRENT - 1e-3)])
    assert_adds_up(found)
