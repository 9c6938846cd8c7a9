"""The decision: held-out losses, ranks, what cannot be told apart."""

import numpy as np
import pytest

from axisight.effects import Effect
from axisight.gap.decide import Trial, block_significance, clearly_worse, inseparable, rank
from axisight.gap.model import Evidence, FreeEffect
from axisight.gap.score import held_out_loss, linear_gain


def linear_evidence(x: np.ndarray, y: np.ndarray, log: np.ndarray, block: int = 20) -> Evidence:
    """Evidence of an ordinary least-squares fit of y on x, cut into blocks."""
    theta = np.linalg.lstsq(x, y, rcond=None)[0]
    residual = x @ theta - y
    starts = np.arange(0, len(y), block)
    matrix = np.array([x[s : s + block].T @ x[s : s + block] for s in starts])
    gradient = np.array([x[s : s + block].T @ residual[s : s + block] for s in starts])
    loss = np.array([(residual[s : s + block] ** 2).sum() for s in starts])
    p = x.shape[1]
    names = tuple((None, f"p{i}") for i in range(p))
    return Evidence(
        effects=(),
        free=(),
        robot_values={},
        std={},
        parameters=names,
        status="loss_converged",
        condition=1.0,
        at_bound=(),
        matrix=matrix,
        gradient=gradient,
        loss=loss,
        log=log[starts],
        axis=np.zeros(len(starts), dtype=np.int64),
        start=starts,
        size=np.full(len(starts), block),
        prior_matrix=np.zeros((p, p)),
        prior_gradient=np.zeros(p),
        residual=residual,
        nuisance_columns={},
    )


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


def test_linear_gain_is_what_least_squares_gains(regression):
    x, y, log = regression
    evidence = linear_evidence(x, y, log)
    shifted = {
        "gradient": evidence.gradient + evidence.matrix @ np.array([0.1, 0.2, -0.3]),
    }
    moved = Evidence(**{**evidence.__dict__, **shifted})
    step = np.array([0.1, 0.2, -0.3])
    total = evidence.matrix.sum(axis=0)
    np.testing.assert_allclose(linear_gain(moved), step @ total @ step, rtol=1e-6)


def a_trial(name: str, n_free: int, held_out: np.ndarray, axis: int = 1) -> Trial:
    names = {
        1: ("viscous_nm_s_rad",),
        2: ("coulomb_nm", "smoothing_rad_s"),
        3: ("forward_nm", "backward_nm", "smoothing_rad_s"),
    }[n_free]
    return Trial(FreeEffect(Effect(name, axis), names), None, held_out)  # type: ignore[arg-type]


LOGS = np.repeat(np.arange(4), 10)
FLOOR = np.full(40, 1.0)
CURRENT = np.full(40, 11.0)


def test_the_better_fit_wins_and_probabilities_sum_to_one():
    good = a_trial("viscous_friction", 1, np.full(40, 1.1))
    poor = a_trial("viscous_friction", 1, np.full(40, 6.0), axis=2)
    ranked = rank([poor, good], CURRENT, FLOOR, LOGS)
    assert ranked[0].trial is good
    assert ranked[0].score == pytest.approx(0.99)
    assert sum(r.probability for r in ranked) == pytest.approx(1.0)
    assert ranked[0].probability > 0.99
    assert len(inseparable(ranked)) == 1


def test_of_equal_fits_the_simpler_wins():
    simple = a_trial("coulomb_friction", 2, np.full(40, 1.1))
    elaborate = a_trial("asymmetric_friction", 3, np.full(40, 1.099))
    ranked = rank([elaborate, simple], CURRENT, FLOOR, LOGS)
    assert ranked[0].trial is simple
    assert ranked[0].probability > 0.8


def test_equal_fits_of_equal_cost_cannot_be_told_apart():
    one = a_trial("viscous_friction", 1, np.full(40, 1.10))
    two = a_trial("viscous_friction", 1, np.full(40, 1.11), axis=2)
    poor = a_trial("viscous_friction", 1, np.full(40, 9.0), axis=3)
    ranked = rank([one, two, poor], CURRENT, FLOOR, LOGS)
    assert {r.trial.label for r in inseparable(ranked)} == {one.label, two.label}


def test_differences_within_formula_error_do_not_decide():
    # One leaves nothing of ten, the other 0.2 % of it: two formulas of one thing.
    one = a_trial("viscous_friction", 1, np.full(40, 1.00))
    two = a_trial("viscous_friction", 1, np.full(40, 1.02), axis=2)
    assert len(inseparable(rank([one, two], CURRENT, FLOOR, LOGS))) == 2


def test_significance_counts_scatter_between_stretches():
    before = np.full(40, 2.0)
    steady = before - 1.0 + 0.01 * np.random.default_rng(1).normal(size=40)
    lucky = before.copy()
    lucky[3] = 0.5
    assert block_significance(before, steady, LOGS) > 30
    # One quarter of sixteen differs: the mean is one standard error from zero.
    assert block_significance(before, lucky, LOGS) == pytest.approx(1.0)


def test_clearly_worse_needs_a_likelihood_ratio():
    assert not clearly_worse(1.01, 1.0)
    assert clearly_worse(1.2, 1.0)
