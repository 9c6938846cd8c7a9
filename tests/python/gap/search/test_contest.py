"""How sets of causes are decided: what is likelier in the place of causes, and when nothing is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.judgement import set_likelier
from axisight.gap.search import contest
from axisight.gap.search.contest import Alternative, Context, Decision, Proposal, decided
from axisight.gap.search.state import SearchState
from gap_data import linear_evidence

N_BLOCKS = 8
LAYOUT = Layout(
    np.zeros(N_BLOCKS, int), np.arange(N_BLOCKS), np.repeat([0, 1], 4), np.full(N_BLOCKS, 100)
)
FLOOR = np.full(N_BLOCKS, 100.0)


class Table:
    """Fits whose losses are known by the labels of their effects; None where they cannot be simulated."""

    adds_up = False

    def __init__(self, losses: dict[tuple[str, ...], float | None]) -> None:
        self.losses = losses
        self.asked: list[tuple[str, ...]] = []

    def fit(self, free: Sequence[Hypothesis], _start: object, **_options: object):
        labels = tuple(sorted(f.effect.label for f in free))
        self.asked.append(labels)
        if self.losses[labels] is None:
            return Diverged("it cannot be simulated")
        return self.of(free)

    def of(self, free: Sequence[Hypothesis]) -> FittedModel:
        loss = self.losses[tuple(sorted(f.effect.label for f in free))] or 0.0
        found = linear_evidence(
            np.ones((N_BLOCKS, 1)), np.zeros(N_BLOCKS), np.repeat([0, 1], 4), block=1
        )
        return replace(
            found,
            loss=np.full(N_BLOCKS, loss / N_BLOCKS),
            gradient=np.zeros((N_BLOCKS, 1)),
            effects=tuple(f.effect for f in free),
            free=tuple(free),
        )


SOFT = Hypothesis(
    Effect("piecewise_stiffness", 1, {"knee_rad": 1e-4}), ("step", "within", "knee_rad")
)
PLAY = Hypothesis(Effect("backlash", 1, {"half_width_rad": 1e-4}), ("half_width_rad",))
CUBIC = Hypothesis(Effect("nonlinear_stiffness", 3, {"cubic_nm_rad3": 1e11}), ("cubic_nm_rad3",))
BESIDE = ("nonlinear_stiffness@3",)
BOTH = ("nonlinear_stiffness@3", "piecewise_stiffness@1")
WITH_PLAY = ("backlash@1", "nonlinear_stiffness@3")


def context(losses: dict[tuple[str, ...], float | None], *free: Hypothesis) -> Context:
    fitter = Table(losses)
    model = fitter.of(free)
    return Context(fitter, SearchState(model, model, FLOOR, LAYOUT), Settings())  # type: ignore[arg-type]


def with_play(losses: dict[tuple[str, ...], float | None]) -> Decision | None:
    """Play in the place of a soft middle, beside a cubic spring."""
    here = context({BESIDE: 8000.0, **losses}, SOFT, CUBIC)
    return decided(here, Proposal(0, (SOFT,), (Alternative(PLAY),)))


def test_a_rival_that_is_likelier_beside_the_others_takes_the_place():
    found = with_play({BOTH: 900.0, WITH_PLAY: 820.0})
    assert found is not None and found.standing is not None
    assert {f.effect.label for f in found.model.free} == set(WITH_PLAY)
    assert found.standing.best.trial.label == "backlash@1"
    # What it took the place of stays its rival.
    assert [r.trial.label for r in found.standing.ranked] == ["backlash@1", "piecewise_stiffness@1"]


@pytest.mark.parametrize("with_it", [1500.0, None])
def test_a_cause_stays_where_its_rival_is_no_likelier_or_cannot_be_simulated(
    with_it: float | None,
):
    assert with_play({BOTH: 820.0, WITH_PLAY: with_it}) is None


def test_a_rival_that_contains_another_cause_is_no_alternative():
    """It would take that out, too: a set that differs in two places."""
    coulomb = Hypothesis(Effect("coulomb_friction", 1, {"coulomb_nm": 0.2}), ("coulomb_nm",))
    offset = Hypothesis(Effect("torque_offset", 1, {"offset_nm": 0.1}), ("offset_nm",))
    both_ways = Hypothesis(
        Effect("asymmetric_friction", 1, {"forward_nm": 0.3}), ("forward_nm", "backward_nm")
    )
    losses = {("coulomb_friction@1",): 8000.0, ("coulomb_friction@1", "torque_offset@1"): 900.0}
    here = context(losses, coulomb, offset)
    assert decided(here, Proposal(0, (offset,), (Alternative(both_ways),))) is None


def test_a_rival_whose_own_sensitivities_diverge_is_none(monkeypatch: pytest.MonkeyPatch):
    def settled(_fitter: object, free: Sequence[Hypothesis], start: FittedModel):
        names = {f.effect.name for f in free}
        return Diverged("diverged at sample 5") if "backlash" in names else start

    monkeypatch.setattr(contest, "settled", settled)
    assert with_play({BOTH: 900.0, WITH_PLAY: 820.0}) is None


@pytest.mark.parametrize(("left", "again"), [(900.0, True), (7000.0, False)])
def test_a_rival_out_of_reach_is_not_fitted_again(
    left: float, again: bool, monkeypatch: pytest.MonkeyPatch
):
    asked: list[str] = []

    def settled(_fitter: object, free: Sequence[Hypothesis], start: FittedModel):
        asked.append(free[-1].effect.label)
        return start

    monkeypatch.setattr(contest, "settled", settled)
    with_play({BOTH: 820.0, WITH_PLAY: left})
    assert asked == (["backlash@1"] if again else [])


@pytest.mark.parametrize(("leeway", "merged"), [(0.0, False), (0.05, True)])
def test_laws_of_one_thing_may_leave_what_their_formulas_differ_by(leeway: float, merged: bool):
    """One spring leaves 300 more than two, of 7,000 that they explain: within 5 %, beyond none."""
    both = ("backlash@1", "piecewise_stiffness@1")
    losses = {(): 8000.0, both: 1000.0, ("piecewise_stiffness@1",): 1300.0}
    here = context(losses, SOFT, PLAY)
    found = decided(here, Proposal(0, (SOFT, PLAY), (Alternative(SOFT),), leeway=leeway))
    assert (found is not None) is merged


def test_a_cause_stays_that_a_loop_swings_without_end_without():
    assert with_play({BOTH: 820.0, WITH_PLAY: 810.0, BESIDE: None}) is None


@pytest.mark.parametrize(
    ("without", "out"),
    [
        # Of 800 residuals five per cent are worth a cause.
        (835.0, True),
        (845.0, False),
    ],
)
def test_a_needless_cause_goes_out(without: float, out: bool):
    here = context({BESIDE: without, BOTH: 800.0}, SOFT, CUBIC)
    found = decided(here, Proposal(0, (SOFT,), or_none="needless"))
    assert (found is not None) is out
    if found is not None:
        assert found.standing is None
        assert [f.effect.label for f in found.model.free] == list(BESIDE)


@pytest.mark.parametrize(
    ("left", "out"),
    [
        # Half of what there is to explain, where a cause of the library explains six tenths.
        (4400.0, True),
        (1000.0, False),
    ],
)
def test_a_doubtful_cause_goes_out_where_something_unknown_is_likelier(left: float, out: bool):
    here = context({BESIDE: 8000.0, BOTH: left}, SOFT, CUBIC)
    found = decided(here, Proposal(0, (SOFT,), or_none="doubtful"))
    assert (found is not None) is out


def weighed(loss: float, *hypotheses: Hypothesis) -> FittedHypothesis:
    *also, last = hypotheses
    fitted = Table({tuple(sorted(h.effect.label for h in hypotheses)): loss}).of(hypotheses)
    return FittedHypothesis(last, fitted, np.full(N_BLOCKS, loss / N_BLOCKS), also=tuple(also))


def test_a_set_is_weighed_by_likelihood_its_numbers_and_how_many_effects_it_has():
    one, several = weighed(1000.0, SOFT), weighed(999.0, SOFT, PLAY)
    assert several.label == "piecewise_stiffness@1 + backlash@1"
    assert several.cost == one.cost + 1
    without = Table({(): 8000.0}).of(())
    # Closed form: a number and an effect more, half the logarithm of sixty blocks each, are worth this ratio.
    worth = float(np.exp(2 * 0.5 * np.log(60) / 30))
    for times, likelier in ((0.999, True), (1.001, False)):
        other = weighed(999.0 * worth * times, SOFT)
        assert set_likelier(other, several, without, FLOOR, LAYOUT, 0) is likelier


def test_an_effect_under_trial_stands_last():
    """Whatever the place: parameters, bounds and deviations go with their effects."""
    effects = (SOFT, PLAY, CUBIC)
    model = replace(
        Table({tuple(sorted(h.effect.label for h in effects)): 1.0}).of(effects),
        parameters=((None, "axis1.mass"), (0, "step"), (1, "half_width_rad"), (2, "cubic_nm_rad3")),
        at_bound=((0, "step"),),
        std={(1, "half_width_rad"): 2.0},
    )
    moved = model.ending_with(SOFT)
    assert [f.effect.name for f in moved.free] == [
        "backlash",
        "nonlinear_stiffness",
        "piecewise_stiffness",
    ]
    assert moved.parameters == (
        (None, "axis1.mass"),
        (2, "step"),
        (0, "half_width_rad"),
        (1, "cubic_nm_rad3"),
    )
    assert moved.at_bound == ((2, "step"),)
    assert moved.std == {(0, "half_width_rad"): 2.0}
