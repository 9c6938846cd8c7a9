"""The decision: held-out losses, ranks, what cannot be told apart."""

from dataclasses import replace

import numpy as np
import pytest

from axisight.effects import Effect
from axisight.gap.fit.data_blocks import Layout, layout_of
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.judgement import stand
from axisight.gap.ranking.likelihood import clearly_worse
from axisight.gap.ranking.posterior import AxisPosterior, of_one_formula
from gap_data import linear_evidence

# The size of an effect is judged in test_gap_amplitude.py.
NO_EFFECT = linear_evidence(np.ones((800, 1)), np.zeros(800), np.zeros(800, int))


def a_trial(name: str, n_free: int, held_out: np.ndarray, axis: int | None = 1) -> FittedHypothesis:
    names = {
        1: ("viscous_nm_s_rad",),
        2: ("coulomb_nm", "smoothing_rad_s"),
        3: ("forward_nm", "backward_nm", "smoothing_rad_s"),
    }[n_free]
    return FittedHypothesis(Hypothesis(Effect(name, axis), names), NO_EFFECT, held_out)


FLOOR = np.full(40, 1.0)
CURRENT = np.full(40, 11.0)
ONE_LOG = np.zeros(40, int)
ONE_AXIS = Layout(ONE_LOG, np.arange(40) // 2, ONE_LOG, np.full(40, 10))


def standing(trials: list[FittedHypothesis], current: np.ndarray = CURRENT) -> AxisPosterior:
    found = stand(trials, current, FLOOR, ONE_AXIS, 0, without=NO_EFFECT, explained_share=0.6)
    assert found is not None
    return found


def total(found: AxisPosterior) -> float:
    return sum(r.probability for r in found.ranked) + found.p_none + found.p_unknown


def test_the_better_fit_wins_and_probabilities_sum_to_one_with_none_and_unknown():
    good = a_trial("viscous_friction", 1, np.full(40, 1.1))
    poor = a_trial("viscous_friction", 1, np.full(40, 6.0), axis=2)
    found = standing([poor, good])
    assert found.best.trial is good
    assert found.best.score == pytest.approx(0.99)
    assert found.best.gain == pytest.approx(0.99)
    assert total(found) == pytest.approx(1.0)
    assert found.best.probability > 0.99
    assert len(found.inseparable()) == 1


@pytest.mark.parametrize(
    ("left", "reached"), [(1.2, True), (3.0, True), (11.0, False)], ids=["near", "behind", "far"]
)
def test_a_rival_that_leaves_many_times_the_loss_is_out_of_reach(left: float, reached: bool):
    # 60 blocks count: 5 times the loss are 48 nats, 2.5 times 27.
    good = a_trial("viscous_friction", 1, np.full(40, 1.1))
    rival = a_trial("viscous_friction", 1, np.full(40, 0.98 * left), axis=2)
    found = standing([good, rival])
    (other,) = found.ranked[1:]
    assert found.in_reach(other) is reached


def test_what_explains_little_is_less_probable_than_something_unknown():
    # Half of what there is to explain, where a cause has to explain six tenths.
    found = standing([a_trial("viscous_friction", 1, np.full(40, 6.0))])
    assert found.p_unknown > 0.9 > found.best.probability
    assert total(found) == pytest.approx(1.0)


def test_where_there_is_nothing_to_explain_no_cause_is_most_probable():
    current = FLOOR + 0.001
    found = standing([a_trial("viscous_friction", 1, FLOOR + 0.0009)], current)
    assert found.p_none > max(found.p_unknown, found.best.probability)


def test_without_its_first_candidates_a_standing_still_sums_to_one():
    one, two = (
        a_trial("viscous_friction", 1, np.full(40, x), axis=k) for k, x in ((1, 1.0), (2, 4))
    )
    left = standing([one, two]).without_first(1)
    assert [r.trial for r in left.ranked] == [two]
    assert total(left) == pytest.approx(1.0)
    assert standing([one, two]).without_first(0) == standing([one, two])


def test_of_equal_fits_the_simpler_wins():
    simple = a_trial("coulomb_friction", 2, np.full(40, 1.1))
    elaborate = a_trial("asymmetric_friction", 3, np.full(40, 1.099))
    found = standing([elaborate, simple])
    assert found.best.trial is simple
    assert found.best.probability > 0.8


def test_equal_fits_of_equal_cost_cannot_be_told_apart():
    one = a_trial("viscous_friction", 1, np.full(40, 1.10))
    two = a_trial("viscous_friction", 1, np.full(40, 1.11), axis=2)
    poor = a_trial("viscous_friction", 1, np.full(40, 9.0), axis=3)
    found = standing([one, two, poor])
    assert {r.trial.label for r in found.inseparable()} == {one.label, two.label}


def test_differences_within_formula_error_do_not_decide():
    # One leaves nothing of ten, the other 0.2 % of it: two formulas of one thing.
    one = a_trial("viscous_friction", 1, np.full(40, 1.00))
    two = a_trial("viscous_friction", 1, np.full(40, 1.02), axis=2)
    assert len(standing([one, two]).inseparable()) == 2


def test_an_axis_is_ranked_by_its_own_loss():
    # Two axes; the first candidate explains the quiet one, the second the loud one.
    layout = Layout(
        np.repeat([0, 1], 20), np.tile(np.arange(20) // 2, 2), ONE_LOG, np.full(40, 10.0)
    )
    current = np.where(layout.axis == 0, 3.0, 101.0)
    quiet = a_trial("viscous_friction", 1, np.where(layout.axis == 0, 1.0, 101.0))
    loud = a_trial("viscous_friction", 1, np.where(layout.axis == 0, 3.0, 1.0), axis=2)
    for axis, mine in enumerate((quiet, loud)):
        found = stand(
            [quiet, loud], current, FLOOR, layout, axis, without=NO_EFFECT, explained_share=0.6
        )
        assert found is not None
        assert [r.trial for r in found.ranked] == [mine]
        assert found.best.score == pytest.approx(1.0)


def blocks(n_logs: int, n_axes: int, n_times: int) -> FittedModel:
    """Evidence of nothing, with blocks as the core orders them: log, axis, time."""
    log, axis, _ = (x.ravel() for x in np.mgrid[:n_logs, :n_axes, :n_times])
    n = len(log)
    empty = linear_evidence(np.zeros((20, 1)), np.zeros(20), np.zeros(20, int))
    where = {"log": log, "axis": axis, "start": 100 * np.arange(n), "size": np.full(n, 100)}
    where["samples"] = np.full(n, 100.0)
    return FittedModel(**(empty.__dict__ | where))


@pytest.mark.parametrize("n_logs", [1, 2, 5])
def test_an_effect_on_one_of_six_axes_is_as_significant_as_on_a_single_axis(n_logs: int):
    rng = np.random.default_rng(3)
    arm, single = blocks(n_logs, 6, 40), blocks(n_logs, 1, 40)
    scatter = 0.1 * rng.normal(size=(n_logs, 40))
    fall = 1.0 + scatter
    before = np.full(len(arm.log), 3.0).reshape(n_logs, 6, 40)
    after = before.copy()
    after[:, 3] -= fall
    found = layout_of(arm).significance(before.ravel(), after.ravel())
    alone = layout_of(single).significance(np.full(n_logs * 40, 3.0), (3.0 - fall).ravel())
    assert found > 6
    assert layout_of(arm).significance(before.ravel(), after.ravel(), axis=3) == pytest.approx(
        alone
    )


def test_stretches_are_pieces_of_time_of_all_axes():
    layout = layout_of(blocks(2, 3, 40))
    assert len(np.unique(layout.stretch)) == 16
    by_log = layout.stretch.reshape(2, 3, 40)
    assert (by_log == by_log[:, :1]).all()
    assert (np.diff(by_log, axis=2) >= 0).all()


def test_significance_counts_scatter_between_stretches():
    before = np.full(40, 2.0)
    steady = before - 1.0 + 0.01 * np.random.default_rng(1).normal(size=40)
    lucky = before.copy()
    lucky[3] = 0.5
    # A normal deviate of 12 is what a t of a few hundred from twenty stretches is worth.
    assert ONE_AXIS.significance(before, steady) > 12
    # One stretch of twenty differs: the mean is one standard error from zero.
    assert ONE_AXIS.significance(before, lucky) == pytest.approx(1.0, abs=0.05)


def test_few_stretches_count_for_less():
    # A t of 4 from four stretches has the probability of a normal deviate of 2.2.
    none = np.zeros(4, int)
    few = Layout(none, np.arange(4), none, np.full(4, 10))
    fall = 4.0 / np.sqrt(4) + np.array([-1.0, 1.0, -1.0, 1.0]) * np.sqrt(3 / 4)
    before = np.full(4, 1e9)
    assert few.significance(before, before - fall) == pytest.approx(2.2, abs=0.05)


@pytest.mark.filterwarnings("error")
def test_losses_of_simulations_that_diverged_have_a_significance():
    none = np.zeros(4, int)
    few = Layout(none, np.arange(4), none, np.full(4, 10))
    fall = 4.0 / np.sqrt(4) + np.array([-1.0, 1.0, -1.0, 1.0]) * np.sqrt(3 / 4)
    before = np.full(4, 1e202)
    assert few.significance(before, before - 1e200 * fall) == pytest.approx(2.2, abs=0.05)
    assert few.significance(np.zeros(4), np.zeros(4)) == 0.0


def test_that_one_log_shows_an_effect_and_another_does_not_is_no_doubt_of_it():
    log = np.repeat([0, 1, 2], 8)
    layout = Layout(np.zeros(24, int), np.arange(24), log, np.full(24, 10))
    rng = np.random.default_rng(2)
    before = np.full(24, 10.0)
    fall = np.array([5.0, 0.0, 4.0])[log] + 0.5 * rng.normal(size=24)
    assert layout.significance(before, before - fall) > 8
    # The same scatter within a log is doubt.
    mixed = layout.significance(before, before - rng.permutation(fall))
    assert mixed < 6


@pytest.mark.parametrize(
    ("behind", "leader"), [(1.02, "viscous_friction"), (1.5, "quadratic_drag")]
)
def test_the_usual_law_leads_where_the_special_one_cannot_be_told_from_it(behind, leader):
    drag = a_trial("quadratic_drag", 1, np.full(40, 1.5))
    viscous = a_trial("viscous_friction", 1, np.full(40, 1.5 * behind))
    found = standing([drag, viscous])
    assert found.best.trial is drag
    led = found.usual_first()
    assert led.best.trial.hypothesis.effect.name == leader
    assert total(led) == pytest.approx(1.0)
    assert len(led.ranked) == 2


def test_what_moves_several_axes_is_held_against_rivals_on_all_of_them():
    axes, pieces = np.repeat([0, 1], 40), np.tile(np.arange(40) // 2, 2)
    two = Layout(axes, pieces, np.zeros(80, int), np.full(80, 10))
    current, floor = np.tile(CURRENT, 2), np.tile(FLOOR, 2)

    both_axes = linear_evidence(np.ones((1600, 1)), np.zeros(1600), np.zeros(1600, int))

    def on_both(axis: int, first: float, second: float) -> FittedHypothesis:
        found = a_trial("viscous_friction", 1, np.repeat([first, second], 40), axis)
        return replace(found, fitted=both_axes)

    true, shadow, elsewhere = on_both(2, 1.1, 1.1), on_both(1, 1.1, 2.0), on_both(3, 1.1, 12.0)
    here, there = (
        stand(
            [true, shadow, elsewhere],
            current,
            floor,
            two,
            axis,
            without=both_axes,
            explained_share=0.6,
        )
        for axis in (0, 1)
    )
    assert here is not None and there is not None
    # On the first axis all do the same; the second has seen more.
    assert len(here.inseparable()) == 3
    here = here.led_by(next(r for r in here.ranked if r.trial is true))
    held = here.with_axes_it_leads([there])
    assert held.best.trial is true and held.best.probability > 0.99
    assert total(held) == pytest.approx(1.0)
    assert here.with_axes_it_leads([]).best.probability == pytest.approx(here.best.probability)


@pytest.mark.parametrize(
    ("fits", "behind", "open_"),
    [
        # A rival that fits the logs better and predicts a little worse is as good.
        (50.0, 0.08, 2),
        (50.0, 0.6, 2),
        # One that fits no better is not, nor is one that predicts less than nine tenths of it.
        (0.0, 0.08, 1),
        (50.0, 1.1, 1),
    ],
)
def test_where_one_predicts_better_and_the_other_fits_better_neither_is_surer(fits, behind, open_):
    first = a_trial("viscous_friction", 1, np.full(40, 1.02))
    rival = a_trial("torque_offset", 1, np.full(40, 1.02 + behind))
    better = replace(NO_EFFECT, loss=NO_EFFECT.loss - fits / len(NO_EFFECT.loss))
    found = standing([first, replace(rival, fitted=better)])
    assert found.best.trial is first
    assert len(found.inseparable()) == open_


def test_a_load_is_more_usual_than_a_link_that_is_not_as_it_was_drawn():
    link = a_trial("link_com", 1, np.full(40, 1.5))
    load = a_trial("payload", 1, np.full(40, 1.5 * 1.02))
    load = replace(load, hypothesis=replace(load.hypothesis, effect=Effect("payload", None)))
    found = standing([link, load])
    assert found.best.trial is link
    before = {r.trial.hypothesis.effect.name: r.probability for r in found.ranked}
    led = found.usual_first()
    after = {r.trial.hypothesis.effect.name: r.probability for r in led.ranked}
    assert led.best.trial is load
    odds = after["payload"] / after["link_com"]
    assert odds == pytest.approx(3 * before["payload"] / before["link_com"])
    # A payload has no rival that is more usual.
    assert led.usual_first() is not led
    again = led.usual_first()
    assert [r.trial for r in again.ranked] == [r.trial for r in led.ranked]
    assert again.best.probability == pytest.approx(led.best.probability)


def test_clearly_worse_needs_a_likelihood_ratio():
    assert not clearly_worse(1.01, 1.0)
    assert clearly_worse(1.2, 1.0)


def test_what_leads_another_axis_surely_is_judged_by_both():
    link = a_trial("link_com", 1, np.full(40, 1.5 * 1.02))
    offset = a_trial("torque_offset", 1, np.full(40, 1.5))
    here = standing([link, offset])
    assert here.best.trial is offset
    # On the other axis the link leaves nothing, and the offset half.
    there = standing(
        [replace(link, held_out=np.full(40, 1.0)), replace(offset, held_out=np.full(40, 1.25))]
    )
    both = here.with_axes_rivals_lead([there])
    assert both.best.trial.label == link.label
    odds, alone, elsewhere = (
        {r.trial.label: r.probability for r in s.ranked} for s in (both, here, there)
    )
    one, other = link.label, offset.label
    product = alone[one] / alone[other] * elsewhere[one] / elsewhere[other]
    assert odds[one] / odds[other] == pytest.approx(product)
    assert here.with_axes_rivals_lead([]).best.trial is offset


def test_a_third_gains_nothing_from_a_rival_that_leads_another_axis():
    """What holds the first against it holds all others that do as badly there."""
    lag, loop, delay = (
        a_trial(name, 1, np.full(40, loss))
        for name, loss in (("actuator_bandwidth", 1.5), ("current_loop", 1.8), ("input_delay", 1.9))
    )
    here = standing([lag, loop, delay])
    there = standing(
        [replace(t, held_out=np.full(40, x)) for t, x in ((lag, 1.6), (loop, 1.6), (delay, 1.0))]
    )
    both = here.with_axes_rivals_lead([there])
    odds, alone = ({r.trial.label: r.probability for r in s.ranked} for s in (both, here))
    assert odds[lag.label] / odds[loop.label] == pytest.approx(alone[lag.label] / alone[loop.label])
    assert odds[delay.label] / odds[loop.label] > alone[delay.label] / alone[loop.label]


def test_many_rivals_leave_a_cause_as_open_as_one():
    """None of three is likely beside it; together they are."""
    first = a_trial("viscous_friction", 1, np.full(40, 1.5))
    names = ("coulomb_friction", "torque_offset", "torque_constant")
    found = standing([first, *(a_trial(n, 1, np.full(40, 1.5 * 1.06)) for n in names)])
    shares = [r.probability for r in found.ranked]
    assert shares[1] < 0.25 * shares[0] and sum(shares[1:]) > shares[0] / 3
    assert len(found.inseparable()) > 1
    assert (
        len(
            standing([first, a_trial("coulomb_friction", 1, np.full(40, 1.5 * 1.06))]).inseparable()
        )
        == 1
    )


def lags() -> list[FittedHypothesis]:
    """A delay, and a lag that predicts better and fits better, by more than fits leave open."""
    delay = a_trial("input_delay", 1, np.full(40, 1.05))
    worse = replace(NO_EFFECT, loss=NO_EFFECT.loss + 1.0)
    return [
        replace(delay, fitted=worse),
        a_trial("actuator_bandwidth", 1, np.full(40, 1.02)),
    ]


def test_lags_of_an_axis_are_held_against_one_another_by_less():
    delay, lag = lags()
    friction = a_trial("coulomb_friction", 1, np.full(40, 1.02))
    found = standing([delay, lag, friction])
    p = {r.trial.hypothesis.effect.name: r.probability for r in found.ranked}
    assert p["actuator_bandwidth"] == pytest.approx(p["coulomb_friction"])
    # Three ten-thousandths of what there was to explain (10), not two hundredths; and twice as sure.
    ratio = (1.05 + 0.003) / (1.02 + 0.003)
    assert p["actuator_bandwidth"] / p["input_delay"] == pytest.approx(ratio**60)
    # Of another axis they leave what the rest of the model does.
    elsewhere = [
        replace(t, hypothesis=replace(t.hypothesis, effect=Effect(t.hypothesis.effect.name, 2)))
        for t in (delay, lag)
    ]
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing(elsewhere).ranked}
    ratio = (1.05 + 0.2) / (1.02 + 0.2)
    assert p["actuator_bandwidth"] / p["input_delay"] == pytest.approx(ratio**30)


def test_of_lags_that_fit_as_well_none_is_surer():
    delay, lag = lags()
    # As a current loop, which is half as likely as a delay like which it is damped.
    loop = replace(
        lag,
        hypothesis=Hypothesis(Effect("current_loop", 1), ("time_constant_s", "damping")),
    )
    same = replace(delay, fitted=loop.fitted)
    for rival, odds in ((lag, 1.0), (loop, 2.0)):
        p = {r.trial.label: r.probability for r in standing([same, rival]).ranked}
        assert p["input_delay@1"] / p[rival.label] == pytest.approx(odds)


def test_loads_of_an_axis_and_of_the_arm_are_held_against_one_another_by_next_to_nothing():
    """What changes rigid bodies has one formula: a load is exact, a heavier link leaves half of the noise more."""
    mass = a_trial("link_mass", 1, np.full(40, 1.5))
    load = a_trial("payload", 3, np.full(40, 1.0), axis=None)
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing([mass, load]).ranked}
    # A ten-thousandth of what there was to explain (10), less two numbers more.
    ratio = (1.5 + 1e-3) / (1.0 + 1e-3)
    assert p["payload"] / p["link_mass"] == pytest.approx(ratio**30 / 60)
    elsewhere = a_trial("link_mass", 1, np.full(40, 1.5), axis=2)
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing([elsewhere, load]).ranked}
    ratio = (1.5 + 0.2) / (1.0 + 0.2)
    assert p["payload"] / p["link_mass"] == pytest.approx(ratio**30 / 60)


def test_constant_errors_of_torque_are_held_against_loads_so_where_one_leaves_nothing():
    constant = a_trial("torque_constant", 1, np.full(40, 1.5))
    load = a_trial("link_mass", 1, np.full(40, 1.0))
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing([constant, load]).ranked}
    assert p["link_mass"] / p["torque_constant"] == pytest.approx((1.501 / 1.001) ** 30)
    # Where the best of them leaves a hundredth of what there was, formulas or something else are missing.
    constant = a_trial("torque_constant", 1, np.full(40, 1.6))
    load = a_trial("link_mass", 1, np.full(40, 1.1))
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing([constant, load]).ranked}
    assert p["link_mass"] / p["torque_constant"] == pytest.approx((1.8 / 1.3) ** 30)


def test_a_deadband_that_is_an_offset_everywhere_is_no_likelier_than_it():
    offset = a_trial("torque_offset", 1, np.full(40, 1.5))
    band = a_trial("torque_deadband", 1, np.full(40, 1.5))
    other = a_trial("torque_saturation", 1, np.full(40, 1.501))
    load = a_trial("link_mass", 1, np.full(40, 1.0))
    found = standing([offset, band, other, load])
    p = {r.trial.hypothesis.effect.name: r.probability for r in found.ranked}
    assert p["torque_deadband"] == pytest.approx(p["torque_offset"]) == pytest.approx(0, abs=1e-4)
    assert p["torque_saturation"] > 5 * p["torque_offset"]


def test_what_is_held_apart_by_next_to_nothing_is_near_enough_for_it():
    losses = {"link_mass": 1.0, "torque_constant": 1.008, "payload": 1.02, "backlash": 1.001}
    found = standing([a_trial(n, 1, np.full(40, loss)) for n, loss in losses.items()])
    assert [r.trial.hypothesis.effect.name for r in of_one_formula(found)] == ["torque_constant"]
    other = found.led_by(next(r for r in found.ranked if r.trial.label == "backlash@1"))
    assert of_one_formula(other) == []


def test_laws_of_friction_are_held_apart_where_one_leaves_hardly_more_than_noise():
    plain = a_trial("coulomb_friction", 1, np.full(40, 1.1))
    uneven = a_trial("asymmetric_friction", 1, np.full(40, 1.0))
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing([plain, uneven]).ranked}
    # Half a thousandth of what there was to explain (10); numbers cost.
    numbers = uneven.cost - plain.cost
    cost = 60.0 ** (0.5 * numbers)
    assert p["asymmetric_friction"] / p["coulomb_friction"] == pytest.approx(
        (1.105 / 1.005) ** 30 / cost
    )
    # Where the best leaves four times the noise, formulas may differ by that.
    plain, uneven = (replace(t, held_out=t.held_out + 4.0) for t in (plain, uneven))
    p = {r.trial.hypothesis.effect.name: r.probability for r in standing([plain, uneven]).ranked}
    assert p["asymmetric_friction"] / p["coulomb_friction"] == pytest.approx(
        (5.3 / 5.2) ** 30 / cost
    )


def bent(trial: FittedHypothesis, *tolerances: float) -> FittedHypothesis:
    """The same with the simulator's own parameters so many of their tolerances off, held there by the data."""
    n, blocks = len(tolerances), len(NO_EFFECT.loss)
    off = np.array(tolerances)
    fitted = replace(
        NO_EFFECT,
        parameters=tuple((None, f"axis{i}.mass") for i in range(n)),
        prior_matrix=np.eye(n),
        prior_gradient=off,
        matrix=np.tile(1e9 * np.eye(n), (blocks, 1, 1)),
        gradient=np.tile(-off / blocks, (blocks, 1)),
    )
    return replace(trial, fitted=fitted)


def test_of_equal_fits_the_one_that_bends_the_simulator_less_is_likelier():
    load = bent(a_trial("viscous_friction", 1, np.full(40, 1.1)), 0.5, 0.5)
    link = bent(a_trial("viscous_friction", 1, np.full(40, 1.1), axis=2), 4.0, 3.0)
    found = standing([link, load])
    assert found.best.trial is load
    # Half of the chi-square of the prior: (16 + 9) / 2 against (0.25 + 0.25) / 2.
    said = {e.hypothesis: e.nats for e in found.ledger if e.rule == "own_parameters"}
    assert said == pytest.approx({link.label: -12.5, load.label: -0.25})
    assert found.ranked[1].probability / found.best.probability == pytest.approx(np.exp(-12.25))


def test_bending_counts_between_weights_that_are_held_apart_too():
    """Both leave next to nothing, and are held against one another by the error of rigid bodies."""
    names = {"link_mass": ("relative_change",), "motor_inertia": ("relative_change",)}
    trials = [
        FittedHypothesis(Hypothesis(Effect(name, 1), free), NO_EFFECT, np.full(40, 1.0))
        for name, free in names.items()
    ]
    straight = standing([bent(trials[0], 0.0), bent(trials[1], 0.0)])
    crooked = standing([bent(trials[0], 4.0), bent(trials[1], 0.0)])
    odds = [
        {r.trial.label: r.probability for r in s.ranked}["link_mass@1"] / s.best.probability
        for s in (straight, crooked)
    ]
    assert odds[0] == pytest.approx(1.0)
    assert odds[1] == pytest.approx(np.exp(-0.5 * 4.0**2))


def sized(coulomb_nm: float, stated_nm: float, axis: int = 1) -> FittedHypothesis:
    """Coulomb friction of this size, where three times the torque of the motor is 2 Nm."""
    effect = Effect("coulomb_friction", axis, {"coulomb_nm": coulomb_nm})
    one = Hypothesis(
        effect, ("coulomb_nm",), stated={"coulomb_nm": stated_nm}, largest={"coulomb_nm": 2.0}
    )
    fitted = replace(NO_EFFECT, effects=(effect,), free=(one,))
    return FittedHypothesis(one, fitted, np.full(40, 1.1))


def test_of_equal_fits_the_one_of_an_ordinary_size_is_likelier():
    usual, giant = sized(0.2, 0.0), sized(9.0, 1.0, axis=2)
    found = standing([giant, usual])
    assert found.best.trial is usual
    # Half of the squared size over its prior, about what the simulator states: (8 / 2)^2 / 2 and (0.2 / 2)^2 / 2.
    said = {e.hypothesis: e.nats for e in found.ledger if e.rule == "size"}
    assert said == pytest.approx({giant.label: -8.0, usual.label: -0.005})
    assert found.ranked[1].probability / found.best.probability == pytest.approx(np.exp(-7.995))


def test_of_what_is_as_likely_that_of_the_axis_comes_first_and_stays_so():
    here = a_trial("viscous_friction", 1, np.full(40, 1.1), axis=1)
    elsewhere = a_trial("viscous_friction", 1, np.full(40, 1.1 - 1e-9), axis=2)
    poor = a_trial("viscous_friction", 1, np.full(40, 6.0), axis=3)
    found = standing([poor, elsewhere, here])
    assert found.ranked[0].probability < found.ranked[1].probability
    assert [r.trial for r in found.ranked] == [here, elsewhere, poor]
    weighed = found.adjusted("other_axes", {poor.label: 0.5})
    assert [r.trial for r in weighed.ranked] == [here, elsewhere, poor]
    # What is clearly likelier is first wherever it acts.
    weighed = found.adjusted("other_axes", {here.label: 0.9})
    assert weighed.best.trial is elsewhere
