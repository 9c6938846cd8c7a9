"""Held-out losses and linear steps of fits, from the normal equations of their blocks."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from axisight.effects import Effect
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import (
    held_out_loss,
    linear_gain,
    linear_step,
    steps_without_each,
    straight_steps_without_each,
)
from axisight.gap.ranking.fitted_hypothesis import trial
from gap_data import linear_evidence


@pytest.fixture
def regression() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(600, 3))
    y = x @ np.array([1.0, -2.0, 0.5]) + 0.3 * rng.normal(size=600)
    return x, y, np.repeat(np.arange(3), 200)


def test_held_out_loss_is_that_of_refitting_without_the_log(regression):
    x, y, log = regression
    held = held_out_loss(linear_evidence(x, y, log))
    for group in range(3):
        inside = log == group
        theta = np.linalg.lstsq(x[~inside], y[~inside], rcond=None)[0]
        brute = ((x[inside] @ theta - y[inside]) ** 2).sum()
        # The ridge against singular matrices is 1e-9 of the diagonal.
        np.testing.assert_allclose(
            held[np.repeat(np.arange(3), 10) == group].sum(), brute, rtol=1e-6
        )


def test_a_log_that_alone_tells_of_an_effect_is_left_out_in_stretches(regression):
    """What the others tell of it is their noise: held against that, the truth loses."""
    x, y, log = regression
    x = x.copy()
    x[log != 1, 2] *= 1e-4
    y = y - regression[0] @ [0, 0, 0.5] + x @ [0, 0, 0.5]
    own = linear_evidence(x, y, log)
    alone = replace(own, parameters=(*own.parameters[:2], (0, "size")))
    held = held_out_loss(alone)
    blocks = np.repeat(np.arange(3), 10)
    for stretch in range(4):
        # Ten blocks of twenty in four stretches of time: three, two, three and two.
        mine = 10 + np.flatnonzero(np.arange(10) * 4 // 10 == stretch)
        inside = np.isin(np.arange(600) // 20, mine)
        theta = np.linalg.lstsq(x[~inside], y[~inside], rcond=None)[0]
        brute = ((x[inside] @ theta - y[inside]) ** 2).sum()
        np.testing.assert_allclose(held[mine].sum(), brute, rtol=1e-5)
    noise = 0.3**2 * 200
    assert held[blocks == 1].sum() == pytest.approx(noise, rel=0.2)
    # Of the simulator's own parameters, which have tolerances, every log is left out as a whole.
    assert held_out_loss(own)[blocks == 1].sum() > 10 * noise
    # One that has another number besides, which every log tells, is judged as that other is.
    more = replace(own, parameters=(own.parameters[0], (0, "other"), (0, "size")))
    np.testing.assert_array_equal(held_out_loss(more), held_out_loss(own))
    # The other logs are left out whole either way.
    np.testing.assert_allclose(held[blocks != 1], held_out_loss(own)[blocks != 1], rtol=1e-12)


def test_linear_gain_is_what_least_squares_gains(regression):
    x, y, log = regression
    fitted = linear_evidence(x, y, log)
    shifted = {
        "gradient": fitted.gradient + fitted.matrix @ np.array([0.1, 0.2, -0.3]),
    }
    moved = FittedModel(**{**fitted.__dict__, **shifted})
    step = np.array([0.1, 0.2, -0.3])
    total = fitted.matrix.sum(axis=0)
    np.testing.assert_allclose(linear_gain(moved), step @ total @ step, rtol=1e-6)


def test_linear_gain_takes_the_simulator_no_further_than_its_bounds(regression):
    x, y, log = regression
    at_least = linear_evidence(x, y, log)
    # Three parameters of the simulator, from whose nominal values the least lies 5, 1 and 0 away.
    least, deviation = np.array([5.0, 1.0, 0.0]), np.array([1.0, 1.0, 1.0])
    fitted = replace(
        at_least,
        gradient=at_least.gradient - at_least.matrix @ least,
        loss=at_least.loss
        - 2 * at_least.gradient @ least
        + np.einsum("bij,i,j->b", at_least.matrix, least, least),
        prior_matrix=np.diag(deviation**-2),
        prior_gradient=np.zeros(3),
    )
    rows = np.vstack([x, np.diag(1 / deviation)])
    aims = np.concatenate([x @ least, np.zeros(3)])
    bounded = scipy.optimize.lsq_linear(rows, aims, bounds=(-4 * deviation, 4 * deviation))
    free = np.linalg.lstsq(rows, aims, rcond=None)[0]
    assert free[0] > 4.0
    assert bounded.x[0] == pytest.approx(4.0)
    gained = aims @ aims - 2 * bounded.cost
    np.testing.assert_allclose(linear_gain(fitted), gained, rtol=1e-6)
    assert gained < 0.99 * (aims @ aims - ((rows @ free - aims) ** 2).sum())


@pytest.mark.parametrize("seed", range(20))
def test_a_linear_step_is_the_least_within_bounds(seed: int):
    # Parameters that look alike: the first step takes several beyond their bounds, some of which
    # belong inside once the others are held.
    rng = np.random.default_rng(seed)
    n = 6
    x = rng.normal(size=(400, n)) @ (0.3 * np.eye(n) + rng.normal(size=(n, n)) * 0.5)
    y = x @ rng.normal(scale=6.0, size=n) + rng.normal(size=400)
    fitted = replace(
        linear_evidence(x, y, np.repeat([0, 1], 200)),
        parameters=tuple((None, f"p{i}") for i in range(n)),
        gradient=np.stack([-(x[k : k + 20].T @ y[k : k + 20]) for k in range(0, 400, 20)]),
        loss=np.array([y[k : k + 20] @ y[k : k + 20] for k in range(0, 400, 20)]),
        prior_matrix=np.eye(n),
        prior_gradient=np.zeros(n),
    )
    rows, aims = np.vstack([x, np.eye(n)]), np.concatenate([y, np.zeros(n)])
    best = scipy.optimize.lsq_linear(rows, aims, bounds=(-4.0, 4.0), method="bvls")
    assert np.any(np.abs(best.x) > 3.999)
    gained = aims @ aims - 2 * best.cost
    np.testing.assert_allclose(linear_gain(fitted), gained, rtol=1e-6)


def test_a_linear_step_leads_back_from_a_bound_that_a_fit_ended_at():
    # What is missing bent the simulator to its bound, which a step with it has to leave.
    rng = np.random.default_rng(4)
    x = rng.normal(size=(200, 2))
    y = x @ np.array([0.5, 3.0])
    at_bound = replace(
        linear_evidence(x, y, np.repeat([0, 1], 100)),
        parameters=((None, "p"), (0, "amplitude")),
        at_bound=((None, "p"),),
        gradient=np.stack(
            [-(x[k : k + 20].T @ (y - 4 * x[:, 0])[k : k + 20]) for k in range(0, 200, 20)]
        ),
        loss=np.array([np.sum((y - 4 * x[:, 0])[k : k + 20] ** 2) for k in range(0, 200, 20)]),
        prior_matrix=np.diag([1.0, 0.0]),
        prior_gradient=np.array([4.0, 0.0]),
    )
    rows, aims = np.vstack([x, [1.0, 0.0]]), np.append(y - 4 * x[:, 0], -4.0)
    best = scipy.optimize.lsq_linear(rows, aims, bounds=([-8.0, -np.inf], [0.0, np.inf]))
    assert best.x[0] == pytest.approx(-3.5, abs=0.1)
    np.testing.assert_allclose(linear_gain(at_bound), aims @ aims - 2 * best.cost, rtol=1e-6)


def test_a_linear_step_does_not_lead_past_a_bound_that_is_no_tolerance():
    # A damping at nothing, with a tolerance that would let it go below.
    x, y = np.ones((40, 1)), np.full(40, -5.0)
    at_nothing = replace(
        linear_evidence(x, y, np.repeat([0, 1], 20)),
        parameters=((None, "damping"),),
        at_bound=((None, "damping"),),
        gradient=np.stack([-(x[k : k + 20].T @ y[k : k + 20]) for k in (0, 20)]),
        loss=np.array([np.sum(y[k : k + 20] ** 2) for k in (0, 20)]),
        prior_matrix=np.array([[0.3**-2]]),
        prior_gradient=np.array([-1.0 * 0.3**-2]),
    )
    assert linear_gain(at_nothing) == 0.0
    assert linear_gain(replace(at_nothing, at_bound=())) > 0.0


def test_a_model_without_parameters_has_no_step():
    """Without causes, and tolerances of nothing that the motion shows."""
    bare = linear_evidence(np.zeros((40, 0)), np.ones(40), np.repeat([0, 1], 20))
    assert linear_step(replace(bare, parameters=())).shape == (0,)
    assert linear_gain(bare) == 0.0


@pytest.fixture
def told_by_one_log():
    """A size and a corner; the second log alone tells of the corner, and how a step without that log goes."""
    rng = np.random.default_rng(5)
    log = np.repeat([0, 1], 400)
    x = np.column_stack([rng.standard_normal(800), rng.standard_normal(800) * (1e-2 + log)])
    y = x @ [1.0, 0.01] + 0.1 * rng.standard_normal(800)
    found = linear_evidence(x, y, log)
    names = ((0, "coulomb_nm"), (0, "smoothing_rad_s"))

    def step(down: float = 5e-3, size: float = 1.0, take=straight_steps_without_each) -> np.ndarray:
        effect = Effect("coulomb_friction", 1, {"coulomb_nm": size, "smoothing_rad_s": 0.01})
        room = {names[0]: (-1.0, 9.0), names[1]: (-down, 1.0)}
        one = replace(found, effects=(effect,), parameters=names, room=room)
        return take(one, one.log)[1]

    return x[log == 0], y[log == 0], np.linalg.lstsq(x, y, rcond=None)[0], step


def test_a_step_takes_the_shape_of_a_law_no_further_than_its_law_is_straight(told_by_one_log):
    """Of itself a tenth, where least squares would go seven times as far as it is large; the rest follows."""
    x, y, theta, step = told_by_one_log
    free = np.linalg.lstsq(x, y, rcond=None)[0] - theta
    assert abs(free[1]) > 5 * 0.01
    moved = step()
    assert moved[1] == pytest.approx(np.sign(free[1]) * 0.1 * 0.01)
    rest = y - x @ theta - x[:, 1] * moved[1]
    # The ridge against singular matrices is 1e-9 of the diagonal.
    assert moved[0] == pytest.approx(x[:, 0] @ rest / (x[:, 0] @ x[:, 0]), rel=1e-5)
    # Where the step itself is asked for, as by how sure a shape is, it goes all the way.
    assert step(take=steps_without_each) == pytest.approx(free, rel=1e-4)


def test_a_step_takes_an_effect_no_further_than_it_is_large(told_by_one_log):
    *_, step = told_by_one_log
    whole = step()
    assert step(size=0.5 * abs(whole[0])) == pytest.approx(0.5 * whole)


def test_a_number_next_to_its_bound_does_not_step_away_from_it(told_by_one_log):
    *_, step = told_by_one_log
    assert step(down=5e-3)[1] != 0.0
    assert step(down=5e-6)[1] == 0.0
    assert step(down=5e-6)[0] != 0.0


def test_what_one_log_tells_of_the_simulator_is_no_gain_of_an_effect_that_it_tells_of():
    """Of a log that alone tells of both: with an effect of no size it is left out in stretches."""
    rng = np.random.default_rng(3)
    log = np.repeat([0, 1], 2000)
    # Columns of a stiffness, say, and of the effect, both in the second log; the true effect is none.
    x = rng.standard_normal((4000, 2)) * (log == 1)[:, None]
    x += 1e-3 * rng.standard_normal(x.shape)
    y = x[:, 0] + rng.standard_normal(4000)

    def fit(columns: list[int], names) -> FittedModel:
        found = linear_evidence(x[:, columns], y, log)
        prior, theta = (
            np.zeros((len(columns),) * 2),
            np.linalg.lstsq(x[:, columns], y, rcond=None)[0],
        )
        prior[0, 0] = 1.0
        return replace(found, parameters=names, prior_matrix=prior, prior_gradient=prior @ theta)

    model = fit([0], ((None, "p0"),))
    effect = Hypothesis(Effect("viscous_friction", 1), ("viscous_nm_s_rad",))
    with_it = fit([0, 1], ((None, "p0"), (0, "viscous_nm_s_rad")))
    with_it = replace(with_it, effects=(effect.effect,), free=(effect,))
    current = held_out_loss(model).sum()
    # The other log knows the prior only: that the model leaves is no gap of the effect.
    assert current - trial(effect, with_it).held_out.sum() > 500
    assert abs(current - trial(effect, with_it, model).held_out.sum()) < 10
    assert held_out_loss(model, like=model).sum() == current


def test_a_gap_that_misleads_the_simulator_more_in_stretches_is_no_gain_of_its_cause():
    """A cause that one log tells of leaves what it leaves: no less for what the gap does to others."""
    rng = np.random.default_rng(4)
    log = np.repeat([0, 1], 2000)
    cause = (log == 1) * rng.standard_normal(4000)
    # What a parameter does in the second log looks like the cause, and in its last quarter like the opposite.
    looks = np.where(np.arange(4000) < 3500, 10.0, -10.0) * cause
    x = np.stack([np.where(log == 1, looks, rng.standard_normal(4000)), cause], 1)
    y = 30.0 * cause + rng.standard_normal(4000)
    model = linear_evidence(x[:, :1], y, log)
    effect = Hypothesis(Effect("viscous_friction", 1), ("viscous_nm_s_rad",))
    with_it = replace(
        linear_evidence(x, y, log),
        parameters=((None, "p0"), (0, "viscous_nm_s_rad")),
        effects=(effect.effect,),
        free=(effect,),
    )
    model = replace(model, parameters=((None, "p0"),))
    assert held_out_loss(model, like=with_it).sum() > held_out_loss(model).sum() + 1e4
    assert trial(effect, with_it, model).held_out == pytest.approx(held_out_loss(with_it))
