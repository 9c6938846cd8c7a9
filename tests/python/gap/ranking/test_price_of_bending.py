"""What own parameters pay for being bent: the least of prior and data, as the belief weighs these."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.ranking.price_of_bending import price_of_bending
from gap_data import linear_evidence

N_BLOCKS = 40


def bent(tolerances: list[float], data: float) -> FittedModel:
    """A fit that ended so many tolerances off, pulled there by data of so many times the prior's curvature."""
    n = len(tolerances)
    off = np.array(tolerances)
    fitted = linear_evidence(
        np.ones((20 * N_BLOCKS, 1)), np.zeros(20 * N_BLOCKS), np.zeros(800, int)
    )
    blocks = len(fitted.loss)
    return replace(
        fitted,
        parameters=tuple((None, f"axis{i}.mass") for i in range(n)),
        at_bound=(),
        prior_matrix=np.eye(n),
        prior_gradient=off,
        # At the least, what the data pull is what the prior pulls back.
        matrix=np.tile(data * np.eye(n) / blocks, (blocks, 1, 1)),
        gradient=np.tile(-off / blocks, (blocks, 1)),
    )


def weights(fitted: FittedModel, weight: float) -> np.ndarray:
    return np.full(len(fitted.loss), weight)


def test_data_that_count_in_full_leave_the_whole_prior():
    fitted = bent([4.0, 3.0], data=10.0)
    assert price_of_bending(fitted, weights(fitted, 1.0)) == pytest.approx(0.5 * 25)


def test_data_that_count_for_nothing_cost_nothing():
    fitted = bent([4.0, 3.0], data=10.0)
    assert price_of_bending(fitted, weights(fitted, 0.0)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("weight", [0.003, 0.1, 0.7])
def test_it_is_the_least_of_prior_and_data(weight: float):
    """Oracle: the same minimum by a general optimiser."""
    fitted = bent([4.0, -1.0, 2.5], data=30.0)

    def both(step: np.ndarray) -> float:
        off = fitted.prior_gradient + step
        data = 2 * fitted.gradient.sum(axis=0) @ step + step @ fitted.matrix.sum(axis=0) @ step
        return float(0.5 * (off @ off + weight * data))

    least = minimize(both, np.zeros(3), tol=1e-12).fun
    assert price_of_bending(fitted, weights(fitted, weight)) == pytest.approx(least, rel=1e-6)


def test_what_the_data_hold_harder_pays_more():
    paid = [price_of_bending(f, weights(f, 0.01)) for f in (bent([4.0], x) for x in (1, 100, 1e4))]
    assert paid[0] < paid[1] < paid[2] < 8.0


def test_a_parameter_at_its_bound_pays_too():
    fitted = bent([4.0], data=10.0)
    held = replace(fitted, at_bound=fitted.parameters)
    assert price_of_bending(held, weights(held, 1.0)) == pytest.approx(8.0)


def test_priors_of_effects_are_no_part_of_it():
    fitted = bent([4.0, 3.0], data=10.0)
    other = replace(fitted, parameters=(fitted.parameters[0], (0, "damping")))
    assert price_of_bending(other, weights(other, 1.0)) <= 0.5 * 4.0**2
