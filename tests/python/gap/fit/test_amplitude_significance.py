"""How sure the size of an effect is."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from axisight.effects import Effect
from axisight.gap.fit.amplitude_significance import amplitude_significance
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import steps_without_each as _steps
from axisight.gap.measure.by_axis import OwnAxes
from axisight.gap.measure.gap_figures import Stage
from gap_data import linear_evidence

BLOCK = 20
N_BLOCKS = 32
STRETCH = np.arange(N_BLOCKS) // 2


def viscous(column: np.ndarray, y: np.ndarray) -> FittedModel:
    """Evidence of viscous friction that shows as ``column``, beside an offset of the robot's own."""
    x = np.stack([np.ones_like(column), column], axis=1)
    theta = np.linalg.lstsq(x, y, rcond=None)[0]
    effect = Effect("viscous_friction", 1, {"viscous_nm_s_rad": float(theta[1])})
    found = linear_evidence(x, y, np.zeros(len(y), int), BLOCK)
    return replace(
        found,
        parameters=((None, "offset"), (0, "viscous_nm_s_rad")),
        effects=(effect,),
        free=(Hypothesis(effect, ("viscous_nm_s_rad",)),),
    )


def test_stretches_that_know_as_much_give_the_t_test_of_their_estimates():
    # Each stretch has an estimate of its own, all equally good: the jackknife is then the t test.
    rng = np.random.default_rng(3)
    size = 1.0 + rng.normal(size=N_BLOCKS // 2)
    column = np.tile([1.0, -1.0], N_BLOCKS * BLOCK // 2)
    y = column * np.repeat(size, 2 * BLOCK)
    tail = scipy.stats.ttest_1samp(size, 0.0).pvalue
    assert amplitude_significance(viscous(column, y), STRETCH) == pytest.approx(
        scipy.stats.norm.isf(tail), abs=0.01
    )


def in_stretches(count: int) -> np.ndarray:
    """A column that shows in the first stretches only."""
    column = np.random.default_rng(1).normal(size=N_BLOCKS * BLOCK)
    column[count * 2 * BLOCK :] = 0.0
    return column


def test_few_stretches_that_agree_are_enough_and_one_is_not():
    noise = 0.1 * np.random.default_rng(2).normal(size=N_BLOCKS * BLOCK)
    six, one = in_stretches(6), in_stretches(1)
    assert amplitude_significance(viscous(six, six + noise), STRETCH) > 5
    assert amplitude_significance(viscous(one, one + noise), STRETCH) < 1


def test_an_amplitude_that_no_stretch_moves_is_left_out(monkeypatch):
    """As one on a bound is: numbers next to one are held there, and no stretch tells of them."""
    noise = 0.1 * np.random.default_rng(2).normal(size=N_BLOCKS * BLOCK)
    column = in_stretches(8)
    alone = viscous(column, column + noise)
    want = amplitude_significance(alone, STRETCH)
    monkeypatch.setattr(
        "axisight.gap.fit.amplitude_significance.steps_without_each",
        lambda found, groups: 0.0 * _steps(found, groups),
    )
    assert want > 5 and amplitude_significance(alone, STRETCH) == 0.0


def test_false_alarms_are_as_rare_as_the_deviate_says():
    # 2,000 draws of noise alone: 2.3 % above 2, with a standard error of 0.33 %; the jackknife's
    # variance is on the large side, so fewer are allowed.
    rng = np.random.default_rng(4)
    column = in_stretches(8)
    found = np.array(
        [
            amplitude_significance(viscous(column, rng.normal(size=len(column))), STRETCH)
            for _ in range(2000)
        ]
    )
    assert 0.005 < np.mean(found > 2.0) < 0.0228 + 4 * 0.0033


def test_an_effect_that_the_simulator_has_is_sure_where_it_differs():
    noise = 0.1 * np.random.default_rng(2).normal(size=N_BLOCKS * BLOCK)
    column = in_stretches(8)
    found = viscous(column, column + noise)
    size = found.effects[0].values()[0]
    for stated, low, high in ((0.0, 4.0, 40.0), (size, 0.0, 0.1), (0.5 * size, 3.0, 40.0)):
        free = replace(found.free[0], stated={"viscous_nm_s_rad": stated})
        assert low <= amplitude_significance(replace(found, free=(free,)), STRETCH) <= high


def test_a_shape_chosen_among_many_says_nothing():
    column = in_stretches(16)
    found = viscous(column, column)
    effect = Effect("coulomb_friction", 1, {"coulomb_nm": 1.0, "smoothing_rad_s": 0.1})
    size = ((None, "offset"), (0, "coulomb_nm"))
    chosen = replace(
        found, parameters=size, effects=(effect,), free=(Hypothesis(effect, ("coulomb_nm",)),)
    )
    assert amplitude_significance(chosen, STRETCH) == 0.0


def one_log(square: float) -> Stage:
    return Stage((np.array([[square]]),), 0.0)


@pytest.mark.parametrize(
    ("share", "carried"), [(1.0, True), (0.7, True), (0.55, False), (0.3, False), (-0.5, False)]
)
def test_causes_carry_over_where_most_of_their_size_is_there(share, carried):
    # Of a change d of the torque the machine shows `share`: the gap goes from (s d)^2 to (s d - d)^2.
    change = 0.09
    given, after = share**2 * change, (share - 1) ** 2 * change
    own = OwnAxes(
        {0: ("coulomb_friction@1",)}, one_log(given + 1.0), one_log(after + 1.0), one_log(change)
    )
    assert (own.not_carried() is None) == carried
