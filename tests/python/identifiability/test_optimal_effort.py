"""Optimal effort: equivalence theorem, closed forms, SLSQP, several limits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, minimize

from axisight.errors import InputError
from axisight.identifiability import optimal_effort

Real = NDArray[np.float64]


def candidates(seed: int, count: int = 30, n: int = 3, rank: int = 2) -> Real:
    """Return random information matrices of two measurements each."""
    rows = np.random.default_rng(seed).standard_normal((count, rank, n))
    return np.asarray(rows.swapaxes(1, 2) @ rows)


def weights(n: int) -> dict[str, Real | None]:
    c = np.zeros((n, n))
    c[0, 0] = 1.0
    return {"D": None, "c": c, "A": np.eye(n)}


@pytest.mark.parametrize("criterion", ["D", "c", "A"])
def test_equivalence_theorem(criterion: str) -> None:
    # Kiefer-Wolfowitz: at the optimum no d_k exceeds its mean, which is the number of parameters for
    # D, and one for the logarithm of a variance. Computed from the definition, not from the result.
    m = candidates(1)
    c = weights(3)[criterion]
    found = optimal_effort(m, weight=c, tolerance=1e-6, max_iterations=200_000)
    assert found.status == "converged"
    assert found.amounts.sum() == pytest.approx(1.0)
    inverse = np.linalg.inv(np.einsum("k,kij->ij", found.amounts, m))
    if c is None:
        d, mean = np.einsum("ij,kji->k", inverse, m), 3.0
    else:
        d = np.einsum("ij,kji->k", inverse @ c @ inverse, m) / np.trace(c @ inverse)
        mean = 1.0
    assert d.max() == pytest.approx(mean, abs=2e-6)
    assert found.amounts @ d == pytest.approx(mean, abs=1e-12)
    # Used candidates reach the mean.
    assert d[found.amounts > 0.01].min() == pytest.approx(mean, abs=1e-3)


@pytest.mark.parametrize("criterion", ["D", "c", "A"])
@pytest.mark.parametrize("limits", [1, 2])
def test_slsqp_finds_the_same_optimum(criterion: str, limits: int) -> None:
    m, c = candidates(2, count=8), weights(3)[criterion]
    # The prior keeps the matrix regular wherever SLSQP looks.
    prior = 0.01 * np.eye(3)
    costs = np.random.default_rng(3).uniform(0.5, 2.0, (limits, 8))

    def loss(a: Real) -> float:
        total = prior + np.einsum("k,kij->ij", a, m)
        if c is None:
            return -float(np.linalg.slogdet(total)[1])
        return float(np.log(np.trace(c @ np.linalg.inv(total))))

    start = np.full(8, 1 / costs.sum(axis=1).max())
    oracle = minimize(
        loss,
        start,
        method="SLSQP",
        bounds=Bounds(0, np.inf),
        constraints=LinearConstraint(costs, -np.inf, 1.0),
        options={"ftol": 1e-12, "maxiter": 1000},
    )
    found = optimal_effort(
        m, weight=c, costs=costs, prior=prior, tolerance=1e-5, max_iterations=200_000
    )
    assert found.status == "converged"
    assert (costs @ found.amounts <= 1 + 1e-12).all()
    # The gap bounds the distance from the optimum; SLSQP is accurate to about 1e-6.
    assert found.criterion == pytest.approx(loss(found.amounts), abs=1e-9)
    assert -1e-5 <= found.criterion - oracle.fun <= found.gap + 1e-5


def test_two_parameters_in_closed_form() -> None:
    # Candidate i informs on parameter i alone. D: equal shares. Sum of variances 1 / (a_i m_i): shares
    # in proportion to 1 / sqrt(m_i), by Lagrange.
    size = np.array([1.0, 9.0])
    m = np.zeros((2, 2, 2))
    m[[0, 1], [0, 1], [0, 1]] = size
    assert optimal_effort(m).amounts == pytest.approx([0.5, 0.5])
    found = optimal_effort(m, weight=np.eye(2), tolerance=1e-9)
    assert found.amounts == pytest.approx([0.75, 0.25], abs=1e-6)


def test_straight_line_is_measured_at_its_ends() -> None:
    # y = a + b x on [-1, 1]: the D-optimal design is half at either end (textbook).
    x = np.linspace(-1, 1, 21)
    rows = np.stack([np.ones_like(x), x], axis=1)
    found = optimal_effort(
        rows[:, :, None] * rows[:, None, :], tolerance=1e-8, max_iterations=10**6
    )
    assert found.amounts[[0, -1]] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert found.criterion == pytest.approx(0.0, abs=1e-7)


def test_prior_replaces_what_is_known_already() -> None:
    # Parameter 1 is known so well that the effort goes to parameter 2.
    m = np.zeros((2, 2, 2))
    m[[0, 1], [0, 1], [0, 1]] = 1.0
    found = optimal_effort(m, prior=np.diag([100.0, 0.0]), tolerance=1e-6)
    assert found.amounts == pytest.approx([0.0, 1.0], abs=1e-3)


def test_several_models_are_a_mean() -> None:
    m = candidates(4, count=10)
    both = np.stack([m, m[::-1]])
    found = optimal_effort(both, tolerance=1e-6, max_iterations=100_000)
    # The problem is the same if the candidates are reversed, so the optimum is symmetric.
    assert found.amounts == pytest.approx(found.amounts[::-1], abs=1e-3)
    assert found.gap <= 1e-6


def test_misuse_is_named() -> None:
    m = candidates(5)
    with pytest.raises(InputError, match="information: expected candidates that together"):
        optimal_effort(m[:1])
    with pytest.raises(InputError, match="costs"):
        optimal_effort(m, costs=-np.ones((1, 30)))
    with pytest.raises(InputError, match="prior"):
        optimal_effort(m, prior=np.eye(2))
    assert optimal_effort(m, max_iterations=3).status == "max_iterations"
