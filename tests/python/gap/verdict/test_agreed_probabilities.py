"""The verdict and its probabilities say the same."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from axisight.gap.facts.result import Candidate
from axisight.gap.verdict.agreed_probabilities import in_agreement
from axisight.gap.verdict.conclusion import Conclusion


def concluded(verdict: str, candidates: list[float], p_none: float, p_unknown: float) -> Conclusion:
    ranking = tuple(Candidate("backlash", k + 1, p, 0.5, 3.0, "") for k, p in enumerate(candidates))
    return Conclusion(verdict, (), ranking, (), None, ranking, p_none, p_unknown, (), ())


def shares(c: Conclusion) -> list[float]:
    return [*(x.probability for x in c.ranking), c.p_none, c.p_unknown]


@given(st.sampled_from(["none", "unknown"]), st.lists(st.floats(1e-9, 1.0), min_size=3, max_size=6))
def test_they_sum_to_one_and_the_verdict_leads(verdict, weights):
    whole = sum(weights)
    *candidates, none, unknown = (w / whole for w in weights)
    before = concluded(verdict, candidates, none, unknown)
    after = in_agreement(before)
    assert sum(shares(after)) == pytest.approx(1.0)
    assert (after.p_none if verdict == "none" else after.p_unknown) >= 0.95 - 1e-12
    # Candidates keep their order and their odds.
    odds = [
        b.probability / a.probability for a, b in zip(before.ranking, after.ranking, strict=True)
    ]
    assert odds == pytest.approx([odds[0]] * len(odds))
    assert after.alternatives == after.ranking


def test_causes_that_validation_contradicts_are_not_likely():
    after = in_agreement(concluded("unknown", [0.999, 0.001], 0.0, 1e-16))
    assert shares(after) == pytest.approx([0.04995, 0.00005, 0.0, 0.95])
    (entry,) = after.ledger
    assert (entry.rule, entry.hypothesis) == ("verdict", "unknown")


@pytest.mark.parametrize(
    ("verdict", "none", "unknown"),
    [("unknown", 0.3, 0.5), ("none", 0.1, 0.1), ("none", 0.14, 0.81), ("none", 0.5, 0.0)],
)
def test_the_ledger_gives_the_probabilities_that_are_told(verdict, none, unknown):
    """Weights times exp of the entries, normalised."""
    before = concluded(verdict, [1 - none - unknown], none, unknown)
    after = in_agreement(before)
    weights = {"backlash@1": before.ranking[0].probability, "none": none, "unknown": unknown}
    for entry in after.ledger:
        weights[entry.hypothesis] *= math.exp(entry.nats)
    whole = sum(weights.values())
    told = [after.ranking[0].probability, after.p_none, after.p_unknown]
    assert [w / whole for w in weights.values()] == pytest.approx(told)


def test_scatter_of_the_simulator_is_none():
    after = in_agreement(concluded("none", [0.05], 0.14, 0.81))
    assert shares(after) == pytest.approx([0.05, 0.95, 0.0])


@pytest.mark.parametrize("verdict", ["explained", "undecidable"])
def test_with_causes_nothing_changes(verdict):
    before = concluded(verdict, [0.9], 0.0, 0.1)
    assert in_agreement(before) is before
