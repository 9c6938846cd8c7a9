"""One effect in the place of several that imitate it."""

import numpy as np
import pytest

from axisight import Effect, Settings, load_robot
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, trial
from axisight.gap.ranking.likelihood import likelier
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.composites import _simpler
from axisight.gap.search.contest import Context, decided
from axisight.gap.search.one_for_several import merged, several_together
from axisight.gap.search.state import SearchState
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import bare_axis, log_of, logs_of, reference

PLAN = {"multisine": ("multisine", 1), "moves": ("moves", 0)}
COULOMB = Hypothesis(
    Effect("coulomb_friction", 1, {"coulomb_nm": 0.05, "smoothing_rad_s": 2.0}),
    ("coulomb_nm", "smoothing_rad_s"),
)
DRAG = Hypothesis(
    Effect("quadratic_drag", 1, {"drag_nm_s2_rad2": 1e-4}),
    ("drag_nm_s2_rad2",),
)
OFFSET = Hypothesis(Effect("torque_offset", 1, {"offset_nm": 0.0}), ("offset_nm",))


def found(real: list[Effect], free: list[Hypothesis]) -> tuple[FittedModel, str | None]:
    """A fit with effects of a machine that has others, and what takes their place."""
    view = ClosedLoopView(
        bare_axis(), logs_of(bare_axis(), real, PLAN, seconds=3.0), Settings(block_s=0.5)
    )
    model = view.fitter.fit(free)
    one = merge_of(view, model, 1)
    return model, None if one is None else one.best.trial.label


def merge_of(view: ClosedLoopView, model: FittedModel, axis: int) -> AxisPosterior | None:
    """How the effect stands that takes the place of several; None where they stay."""
    floor = view.floor.expected[model.axis] * model.size
    state = SearchState(model, model, floor, layout_of(model))
    context = Context(view.fitter, state, view.settings, view.candidates(model, axes=[axis]))
    decisions = (decided(context, proposal) for proposal in merged(context))
    return next((d.standing for d in decisions if d is not None), None)


@pytest.fixture(scope="module")
def viscous() -> list[Effect]:
    return [Effect("viscous_friction", 1, {"viscous_nm_s_rad": 0.01})]


def test_two_laws_that_imitate_a_third_give_way_to_it(viscous):
    model, label = found(viscous, [COULOMB, DRAG])
    assert list(several_together(model)) == [(1, "friction")]
    assert label == "viscous_friction@1"


def test_two_laws_that_are_there_stay(viscous):
    dry = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.3})
    names = ("viscous_nm_s_rad",), ("coulomb_nm", "smoothing_rad_s")
    free = [Hypothesis(e, n) for e, n in zip([*viscous, dry], names, strict=True)]
    model, label = found([*viscous, dry], free)
    assert several_together(model)
    assert label is None


def test_effects_of_other_kinds_are_not_several(viscous):
    model, label = found(viscous, [COULOMB, OFFSET])
    assert not several_together(model)
    assert label is None


ONE_SIDED = Effect(
    "asymmetric_friction", 1, {"forward_nm": 0.6, "backward_nm": 0.2, "smoothing_rad_s": 2.0}
)


def test_dry_friction_and_a_constant_are_friction_that_is_larger_one_way():
    """Three numbers either way; about standstill it is no constant."""
    _, label = found([ONE_SIDED], [COULOMB, OFFSET])
    assert label == "asymmetric_friction@1"


def test_friction_that_does_nearly_as_well_is_named_beside_what_it_is_a_part_of():
    def ranked(effect: Effect, probability: float) -> RankedHypothesis:
        candidate = Hypothesis(effect, tuple(effect.parameters or {}))
        return RankedHypothesis(
            FittedHypothesis(candidate, None, np.ones(1)), 0.99, 1.0, 9.0, probability
        )

    standing = AxisPosterior(0, (ranked(ONE_SIDED, 0.6), ranked(COULOMB.effect, 0.4)), 0.0, 0.0)
    led = _simpler(standing, None)
    assert [(r.trial.label, r.probability) for r in led.inseparable()] == [
        ("coulomb_friction@1", 0.4),
        ("asymmetric_friction@1", 0.6),
    ]


def test_dry_friction_and_a_constant_that_are_there_stay():
    real = [
        COULOMB.effect.with_values({"coulomb_nm": 0.4}),
        Effect("torque_offset", 1, {"offset_nm": 0.3}),
    ]
    _, label = found(real, [COULOMB, OFFSET])
    assert label is None


def test_a_number_more_costs_as_in_the_ranking():
    # Half the logarithm of sixty blocks a number: a loss 7.06 % smaller is worth one.
    worth = float(np.exp(np.log(60) / 60))
    assert likelier(1.0, 3.0, than=(1.001 * worth, 2.0))
    assert not likelier(1.0, 3.0, than=(0.999 * worth, 2.0))
    assert likelier(1.0, 2.0, than=(1.0, 3.0))


def in_place_of(
    machine: list[Effect], free: list[Hypothesis], arm: str = "irb6600_like"
) -> tuple[FittedModel, str | None, int]:
    """A fit of an arm with effects of a machine that has others, what takes their place, and its axis from 0."""
    robot = load_robot(arm)
    n = int(3.0 / robot.sample_time_s)
    logs = []
    for run in range(2):
        wanted = [reference("multisine", 3 * run + i, n, robot.sample_time_s) for i in range(3)]
        logs.append(log_of(robot, machine, np.hstack(wanted), run))
    view = ClosedLoopView(robot, logs, Settings(block_s=0.5))
    model = view.fitter.fit(free)
    one = merge_of(view, model, 3)
    return model, *((None, -1) if one is None else (one.best.trial.label, one.axis))


LOAD = Effect("payload", None, {"mass_kg": 100.0, "x_m": 0.7, "y_m": 0.05, "z_m": 0.25})


def test_a_link_that_is_heavier_and_off_its_centre_is_a_load():
    """What a mass on the last link does is what two changes of that link do, and is met more often."""
    parts = [
        Hypothesis(Effect("link_mass", 3, {"relative_change": 0.1}), ("relative_change",)),
        Hypothesis(
            Effect("link_com", 3, {"x_m": 0.0, "y_m": 0.0, "z_m": 0.0}), ("x_m", "y_m", "z_m")
        ),
    ]
    model, label, axis = in_place_of([LOAD], parts)
    assert list(several_together(model)) == [(3, "load")]
    assert (label, axis) == ("payload", 2)


@pytest.mark.parametrize("heavier", [True, False])
def test_a_load_at_the_centre_of_the_last_link_is_a_heavier_link(heavier: bool):
    """One number does what four do; a load elsewhere stays one."""
    link = Effect("link_mass", 3, {"relative_change": 0.1})
    free = [Hypothesis(LOAD, ("mass_kg", "x_m", "y_m", "z_m"))]
    _, label, axis = in_place_of([link if heavier else LOAD], free)
    assert (label, axis) == (("link_mass@3", 2) if heavier else (None, -1))


def test_a_load_of_which_hardly_more_than_the_mass_shows_stays_one():
    """A slide lifts it, and where it sits moves two axes a little: a heavier link leaves that, of next to nothing."""
    load = Effect("payload", None, {"mass_kg": 0.5, "x_m": 0.08, "y_m": 0.02, "z_m": -0.13})
    free = [Hypothesis(load, ("mass_kg", "x_m", "y_m", "z_m"))]
    model, label, _ = in_place_of([load], free, arm="scara_like")
    assert label is None
    assert trial(model.free[-1], model).cost < 4
