"""A simulation that diverges is an answer within a search; misuse comes through to the caller."""

import numpy as np
import pytest

from axisight import Effect, InputError, Settings
from axisight.fitting.divergence import Diverged, must_hold
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.time_limit import TimeLimit, TimeUp
from axisight.gap.screening.screening import ScreeningModel
from axisight.gap.search.search import search
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import bare_axis, logs_of, scattered

PLAN = {"multisine": ("multisine", 1), "moves": ("moves", 0)}
# An axis that the robot does not have.
MISPLACED = Hypothesis(Effect("torque_offset", 7, {"offset_nm": 0.1}), ())
# More than a step of a sample can follow.
STIFF = Hypothesis(Effect("viscous_friction", 1, {"viscous_nm_s_rad": 1e4}), ())


def compared() -> ClosedLoopView:
    machine = scattered(bare_axis(), 4)
    logs = logs_of(machine, [Effect("torque_offset", 1, {"offset_nm": 0.4})], PLAN, seconds=1.5)
    return ClosedLoopView(bare_axis(), logs, Settings(block_s=0.25))


@pytest.fixture(scope="module")
def view() -> ClosedLoopView:
    return compared()


@pytest.fixture(scope="module")
def model(view: ClosedLoopView) -> FittedModel:
    return must_hold(view.fitter.fit([]))


def test_a_search_does_not_pass_over_misuse():
    view = compared()  # its own: what is interrupted is cancelled

    def candidates(found: FittedModel) -> list[Hypothesis]:
        return [*view.candidates(found), MISPLACED]

    with pytest.raises(InputError, match=r"torque_offset.*an axis from 1 to 1, got axis 7"):
        search(
            view.fitter,
            candidates,
            view.floor.expected,
            view.settings,
            lambda *_: None,
            TimeLimit.none(),
        )


@pytest.mark.parametrize("adds_up", [True, False])
def test_the_model_refutes_a_floor_where_errors_of_axes_add_up(
    view: ClosedLoopView, model: FittedModel, adds_up: bool, monkeypatch: pytest.MonkeyPatch
):
    """In closed loop, noise of sensors is that of the loop, whatever a model leaves."""
    monkeypatch.setattr(view.fitter, "adds_up", adds_up)
    loud = 1e9 * view.floor.expected

    def ends(found: FittedModel) -> list[Hypothesis]:
        raise TimeUp

    found = search(
        view.fitter, ends, loud, view.settings, lambda *_: None, TimeLimit.none(), baseline=model
    )
    assert np.all(found.noise < 1.0) == adds_up
    stays = found.floor == pytest.approx(loud[model.axis] * model.samples)
    assert stays != adds_up


def test_misuse_comes_through_a_screen(view: ClosedLoopView, model: FittedModel):
    bench = ScreeningModel(view.fitter, model)
    for solve in (view.fitter.fit, view.fitter.evaluate, view.fitter.loss):
        with pytest.raises(InputError, match="an axis from 1 to 1, got axis 7"):
            bench.attempt(solve, MISPLACED, None)
    assert not bench.skipped


def test_what_diverges_is_said_with_its_place(view: ClosedLoopView, model: FittedModel):
    """Every way to ask of a model answers alike; a screen passes over it and says why."""
    fitter = view.fitter
    answers = [
        fitter.fit([STIFF], model),
        fitter.evaluate([STIFF], model),
        fitter.loss([STIFF], model),
        fitter.evaluate_each([STIFF], model),
    ]
    assert all(isinstance(found, Diverged) for found in answers)
    for found in answers:
        assert found.logs == [0, 1]
        assert str(found) == f"the simulation failed: diverged at sample {found.sample}"
    bench = ScreeningModel(fitter, model)
    assert bench.attempt(fitter.evaluate, STIFF, None) is None
    # Along runs of the model, as a screen goes, it ends elsewhere.
    along = fitter.evaluate([STIFF], model, near=bench.near)
    assert bench.skipped == {STIFF.effect.label: str(along)}


def test_a_model_that_has_to_hold_raises_where_it_does_not():
    assert must_hold(3.0) == 3.0
    with pytest.raises(InputError, match="the simulation failed: no equilibrium"):
        must_hold(Diverged("no equilibrium"))


def test_a_divergence_says_what_it_is():
    found = Diverged("diverged at sample 5", logs=np.array([2, 3]), sample=5)
    assert (found.logs, found.sample) == ([2, 3], 5)
    assert repr(found) == 'Diverged("diverged at sample 5")'
