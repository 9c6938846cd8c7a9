"""A cause whose interval includes nothing is replaced or removed, however likely it is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.fitting.divergence import must_hold
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.intervals import sureness
from axisight.gap.search.contest import Alternative, Context, Proposal, decided
from axisight.gap.search.state import SearchState
from axisight.gap.search.unsure_size import unsure
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import PLAN, bare_axis, logs_of

WAVE = Effect("torque_ripple", 1, {"order_1": 6, "cosine_1_nm": 0.1, "sine_1_nm": 0.02})
FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.1})


# The formula of Coulomb friction adds little to these intervals of 1.96 standard errors.
@pytest.mark.parametrize(
    ("effect", "free", "std", "known", "least", "most"),
    [
        (FRICTION, ("coulomb_nm",), {"coulomb_nm": 0.1}, {}, 1.9, 2.05),
        (FRICTION, ("coulomb_nm",), {"coulomb_nm": 0.25}, {}, 0.7, 0.9),
        # What the simulator has already is nothing new.
        (
            FRICTION,
            ("coulomb_nm",),
            {"coulomb_nm": 0.1},
            {"stated": {"coulomb_nm": 0.35}},
            0.2,
            0.3,
        ),
        # A regression that leaves the bodies free tells less than the fit that does not.
        (
            FRICTION,
            ("coulomb_nm",),
            {"coulomb_nm": 0.1},
            {"sure": {"coulomb_nm": (0.01, 1.0)}},
            0.75,
            0.85,
        ),
        # One wave that is sure on either side is sure.
        (WAVE, ("cosine_1_nm", "sine_1_nm"), {"cosine_1_nm": 0.01, "sine_1_nm": 0.1}, {}, 4, 5.2),
        (WAVE, ("cosine_1_nm", "sine_1_nm"), {"cosine_1_nm": 0.1, "sine_1_nm": 0.1}, {}, 0.4, 0.6),
        # Without a fitted amplitude there is nothing to be unsure of.
        (FRICTION, ("smoothing_rad_s",), {"smoothing_rad_s": 9.0}, {}, 1e9, np.inf),
    ],
)
def test_sizes(effect, free, std, known, least, most):
    assert least <= sureness(effect, Hypothesis(effect, free, **known), std) <= most


@pytest.fixture(scope="module")
def searched() -> tuple[Context, SearchState]:
    """A model with friction that the machine has, and with a ripple that it lacks and that noise makes."""
    view = ClosedLoopView(bare_axis(), logs_of(bare_axis(), [FRICTION], PLAN), Settings(threads=1))
    baseline = must_hold(view.fitter.fit([]))
    free = [
        Hypothesis(FRICTION, ("coulomb_nm",)),
        Hypothesis(WAVE, ("cosine_1_nm", "sine_1_nm")),
    ]
    model = must_hold(view.fitter.fit(free, baseline))
    floor = view.floor.expected[baseline.axis] * baseline.samples
    state = SearchState(baseline, model, floor, layout_of(baseline))
    return Context(view.fitter, state, view.settings), state


@pytest.fixture
def entered(searched, monkeypatch):
    """The state with causes whose posteriors do not matter."""
    _, state = searched
    found = [(of_trial(f.effect.label), of_axis()) for f in state.model.free]
    monkeypatch.setattr(SearchState, "accepted", property(lambda _: found))
    return state


def test_only_the_one_that_noise_makes_goes_out(searched, entered):
    context, _ = searched
    (proposal,) = unsure(context)
    assert proposal.labels == {"torque_ripple@1"} and proposal.never_stays
    decision = decided(context, proposal)
    assert decision is not None and decision.standing is None
    assert [f.effect.label for f in decision.model.free] == ["coulomb_friction@1"]


def test_one_that_is_sure_for_any_bodies_goes_out_too_and_the_least_sure_comes_first(
    searched, entered, monkeypatch
):
    context, state = searched
    friction, wave = state.model.free
    # The regression told no more than that there is some friction.
    barely = replace(friction, sure={"coulomb_nm": (1e-3, 0.81)})
    monkeypatch.setattr(entered, "model", replace(state.model, free=(barely, wave)))
    first, second = unsure(context)
    assert first.labels == {"torque_ripple@1"}
    assert second.gone == (barely,)


def test_without_rivals_a_cause_that_explains_the_logs_goes_out(searched):
    context, state = searched
    (friction, _) = state.model.free
    decision = decided(context, Proposal(0, (friction,), never_stays=True))
    assert decision is not None and decision.standing is None
    assert [f.effect.label for f in decision.model.free] == ["torque_ripple@1"]


def test_a_rival_that_explains_nothing_does_not_take_its_place(searched):
    context, state = searched
    (friction, _) = state.model.free
    rival = Hypothesis(Effect("torque_offset", 1, {"offset_nm": 0.0}), ("offset_nm",))
    decision = decided(context, Proposal(0, (friction,), (Alternative(rival),), never_stays=True))
    assert decision is not None and decision.standing is None


def of_trial(label: str):
    return SimpleNamespace(trial=SimpleNamespace(label=label))


def of_axis():
    return SimpleNamespace(axis=0, ranked=())
