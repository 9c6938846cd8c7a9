"""Fits that part of the data brings most of the way end where fits to all of it do."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.settling import settled
from axisight.gap.screening.partial_fit import Begun, TrialFit
from axisight.gap.screening.screening import Screening, ScreeningModel, Start, thinned
from axisight.gap.search.search import refitted
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import bare_axis, logs_of, scattered

PLAN = {"multisine": ("multisine", 1), "moves": ("moves", 0)}
TRUE = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.3})


@pytest.fixture(scope="module")
def view() -> ClosedLoopView:
    # Long enough for their halves to tell.
    logs = logs_of(scattered(bare_axis(), 4), [TRUE], PLAN, seconds=8.2)
    return ClosedLoopView(bare_axis(), logs, Settings())


@pytest.fixture(scope="module")
def whole(view: ClosedLoopView) -> FittedModel:
    return view.fitter.fit([], refreshes=1)


@pytest.fixture(scope="module")
def friction(view: ClosedLoopView, whole: FittedModel) -> Hypothesis:
    return next(o for o in view.candidates(whole) if o.effect.label == TRUE.label)


@pytest.fixture(scope="module")
def screen(view: ClosedLoopView, whole: FittedModel) -> Screening:
    above = whole.loss - view.floor.expected[whole.axis] * whole.samples
    found = thinned(ScreeningModel(view.fitter, whole), above, layout_of(whole))
    assert found.bench.fitter is not view.fitter
    return found


def test_halves_bring_a_candidate_most_of_the_way(view, whole, friction, screen):
    tryout = TrialFit(ScreeningModel(view.fitter, whole), screen)
    begun = tryout.begun(Start(friction, whole.robot_values, 1.0))
    looked_at = tryout.ended(begun)
    direct = view.fitter.fit([friction], whole, lazy=True)
    assert looked_at is not None
    # The whole is looked at where the fit to the halves ended, and not fitted.
    (effect,) = looked_at.fitted.effects
    assert effect.parameters == begun.option.effect.parameters != friction.effect.parameters
    assert looked_at.fitted.robot_values == pytest.approx(begun.robot_values)
    gain = whole.total - direct.total
    # What a step from there would gain is part of the score.
    fall = float(held_out_loss(whole).sum() - looked_at.held_out.sum())
    assert 0.9 * gain < fall <= gain * (1 + 2e-3)
    # A trial is of the candidate as it was offered.
    assert looked_at.hypothesis is friction


def test_where_a_screen_has_all_data_candidates_are_fitted_to_it(view, whole, friction):
    bench = ScreeningModel(view.fitter, whole)
    tryout = TrialFit(bench, Screening(bench))
    begun = tryout.begun(Start(friction, whole.robot_values, 1.0))
    assert begun == Begun(begun.start, friction, whole.robot_values)
    fitted = tryout.ended(begun)
    direct = view.fitter.fit([friction], whole, lazy=True)
    assert fitted is not None
    # Both end where a step promises less than a thousandth; of few steps that are left, each may bring that.
    assert fitted.fitted.total == pytest.approx(direct.total, rel=5e-3)


def test_what_stands_elsewhere_stays_as_it_is(view, whole, friction, screen):
    """Its sensitivities are those of the model, and need not be renewed."""
    here = Hypothesis(Effect("torque_offset", 1, {"offset_nm": 0.1}), ("offset_nm",))
    moved = here.at({"offset_nm": 0.2})
    model = replace(whole, free=(here,))
    tryout = TrialFit(ScreeningModel(view.fitter, model), screen)
    elsewhere = replace(friction, effect=Effect("coulomb_friction", 2, friction.effect.parameters))
    assert tryout._moved(moved, elsewhere) is here
    assert tryout._moved(moved, friction) is moved


def test_sensitivities_of_halves_are_those_of_the_whole_cut(view, whole, screen):
    own = view.fitter.beginnings().fit([], whole, max_iterations=0)
    for key, column in screen.model.columns.items():
        mine, cut = own.columns[key].values, column.values
        assert mine.shape == cut.shape
        # But for what the weights smear over the end, in their last tenth.
        rows = first_nine_tenths(own)
        assert np.linalg.norm((mine - cut)[rows]) <= 0.03 * np.linalg.norm(mine[rows])


def first_nine_tenths(fitted: FittedModel) -> np.ndarray:
    out = np.zeros(len(fitted.residual), dtype=bool)
    for log in np.unique(fitted.log):
        mine = fitted.log == log
        first, size = fitted.start[mine].min(), fitted.size[mine].sum()
        out[first : first + int(0.9 * size)] = True
    return out


def test_a_model_and_a_simulator_settle_where_they_would_without(view, whole, friction, screen):
    again = refitted(view.fitter, lambda *_: None)
    assert again.total == pytest.approx(whole.total, rel=1e-3)
    worth = 1e-4 * whole.total
    direct = settled(view.fitter, [friction], whole, worth=worth)
    begun = settled(view.fitter, [friction], whole, rough=screen.bench.fitter, worth=worth)
    assert begun.renewed and begun.converged
    # A step of either fit has to be worth a share of 1e-4 of the loss, which is its distance from
    # the least, squared, in standard deviations of white noise.
    assert begun.total == pytest.approx(direct.total, rel=2e-4)
    apart = np.array([begun.robot_values[n] - direct.robot_values[n] for n in begun.robot_values])
    own = [i for i, (place, _) in enumerate(direct.parameters) if place is None]
    covariance = np.linalg.inv(direct.matrix.sum(axis=0) + direct.prior_matrix)
    deviation = np.sqrt(np.diag(covariance))[own]
    np.testing.assert_array_less(
        np.abs(apart), 2 * np.sqrt(1e-4 * direct.total) * deviation + 1e-12
    )
