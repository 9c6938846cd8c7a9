"""A torque constant that the controller asks for, among rivals that move the machine as it does."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from axisight import Effect
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.result import Interval
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.reported_torque import with_constants_told
from axisight.gap.search.state import Round, SearchState
from gap_data import linear_evidence

ERROR = "relative_error"
SHARE = 0.05
INVERSE = 1 / 1.05 - 1


@dataclass
class Fitter:
    """Fits that leave the same with any effect of one number, but for those in ``more``."""

    more: dict = field(default_factory=dict)
    seen: list = field(default_factory=list)
    adds_up = False

    def fit(self, free, start, **_options):
        self.seen.append(free)
        return fitted(free[-1], self.more.get(free[-1].effect.label, 1.0))


def fitted(free: Hypothesis, loss: float = 1.0):
    rng = np.random.default_rng(1)
    x = rng.standard_normal((400, 1))
    found = linear_evidence(x, loss * rng.standard_normal(400), np.repeat([0, 1], 200))
    return replace(found, free=(free,), effects=(free.effect,))


def free(name: str, value: float) -> Hypothesis:
    parameter = {"link_mass": "relative_change"}.get(name, ERROR)
    return Hypothesis(Effect(name, 1, {parameter: value}), (parameter,))


def searched(error: float, share: float = 0.4) -> SearchState:
    mass, constant = free("link_mass", 0.06), free("torque_constant", error)
    ranked = tuple(
        RankedHypothesis(FittedHypothesis(f, fitted(f), np.zeros(1)), 0.999, 1.0, 10.0, p)
        for f, p in ((mass, 1 - share), (constant, share))
    )
    ranked = tuple(sorted(ranked, key=lambda r: -r.probability))
    standing = AxisPosterior(0, ranked, 0.0, 0.0)
    model = fitted(ranked[0].trial.hypothesis)
    taken = Round((standing,), ((ranked[0], standing),), np.zeros(1))
    layout = None
    return SearchState(model, model, np.zeros(len(model.loss)), layout, [taken])


def shown(proportional: float = SHARE, integral: float = SHARE) -> AlgebraicCause:
    values = {"relative_proportional": proportional, "relative_integral": integral}
    found = {k: Interval(v, v - 0.004, v + 0.004) for k, v in values.items()}
    return AlgebraicCause("controller_gain", 1, found, 1000, 1.0, "")


@pytest.fixture(autouse=True)
def _no_layout(monkeypatch):
    monkeypatch.setattr(SearchState, "left", lambda _self: np.zeros(1))


def test_the_constant_that_the_share_asks_for_takes_the_place_of_a_heavier_link():
    fitter = Fitter()
    found = with_constants_told(searched(INVERSE + 0.003), fitter, [shown()])
    ((cause, standing),) = found.accepted
    assert cause.trial.label == "torque_constant@1"
    # Ten times as likely as before, which leaves the link no rival.
    assert cause.probability == pytest.approx(4.0 / 4.6)
    assert standing.inseparable() == [cause]
    # It is held where the share has it.
    assert found.model.free[-1].priors == {ERROR: (pytest.approx(INVERSE), 5e-4)}
    assert found.model.free[-1].effect.values()[0] == pytest.approx(INVERSE)


def test_a_constant_that_leads_is_surer():
    found = with_constants_told(searched(INVERSE, share=0.6), Fitter(), [shown()])
    ((cause, _),) = found.accepted
    assert cause.trial.label == "torque_constant@1"
    assert cause.probability == pytest.approx(6.0 / 6.4)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        # No inverse; gains that are set one by one; a controller as stated.
        (INVERSE + 0.03, [shown()]),
        (INVERSE, [shown(integral=0.08)]),
        (INVERSE, []),
    ],
)
def test_a_link_stays_where_no_share_asks_for_the_constant(error, said):
    found = with_constants_told(searched(error), Fitter(), said)
    assert [c.trial.label for c, _ in found.accepted] == ["link_mass@1"]


def test_a_constant_that_leaves_more_beside_the_others_does_not_take_the_place():
    found = with_constants_told(searched(INVERSE), Fitter({"torque_constant@1": 2.0}), [shown()])
    assert [c.trial.label for c, _ in found.accepted] == ["link_mass@1"]
    unlikely = with_constants_told(searched(INVERSE, share=0.01), Fitter(), [shown()])
    assert [c.trial.label for c, _ in unlikely.accepted] == ["link_mass@1"]
