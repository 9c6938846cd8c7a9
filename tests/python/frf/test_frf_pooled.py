"""Weights of lines from their neighbours' variances."""

import numpy as np
import pytest
from scipy import special

from axisight.frf.pooled import IMPROBABLE, neighbours_for, pooled_variance

LINES = 120
GROWTH = np.exp(0.03 * np.arange(LINES))[:, None]


def test_freedom_adds_up_to_thirty() -> None:
    """Neighbours of nu degrees give a logarithm of variance psi'(nu) / count: 1/30 is wanted."""
    assert neighbours_for(None, 400) == neighbours_for(30.0, 400) == 0
    for freedom in (1.0, 2.0, 3.0, 7.0, 20.0):
        count = neighbours_for(freedom, 400)
        assert count % 2 == 0
        assert special.polygamma(1, freedom) / count <= 1 / 30
        assert count == 4 or special.polygamma(1, freedom) / (count - 2) > 1 / 30
    assert neighbours_for(2.0, 30) == 10


@pytest.mark.parametrize("level", [1.0, np.cos(np.arange(LINES))[:, None] ** 2 + 0.1])
def test_an_exponential_is_a_straight_line(level: np.ndarray | float) -> None:
    """Without scatter, and relative to a magnitude however rough: exact but for the constant."""
    variance = GROWTH * level
    found = pooled_variance(np.sqrt(level) * np.ones((LINES, 1)), variance, 1e6, 12)
    np.testing.assert_allclose(found, variance, rtol=2e-6)


def test_own_variance_says_nothing_unless_improbable() -> None:
    """Twice as large changes no own weight but those of the neighbours; 100 times is kept."""
    rng = np.random.default_rng(0)
    variance = rng.gamma(2.0, 0.5, (LINES, 1))
    magnitude = np.ones((LINES, 1))
    before = pooled_variance(magnitude, variance, 2.0, 20)
    variance[60] = 2 * before[60]
    after = pooled_variance(magnitude, variance, 2.0, 20)
    assert after[60] == pytest.approx(before[60])
    assert after[61] != before[61] and after[71] == before[71]
    variance[60] = 100 * before[60]
    assert pooled_variance(magnitude, variance, 2.0, 20)[60] == variance[60]


@pytest.mark.parametrize("freedom", [1.0, 2.0, 7.0])
def test_scatter_is_what_the_distribution_says(freedom: float) -> None:
    """4,000 elements: logarithms without bias (three standard deviations of their mean, whose
    lines are correlated over the window) and as narrow as a mean of that many; hardly a line
    keeps its own variance (more than by the F distribution, which the logarithms only resemble)."""
    rng = np.random.default_rng(1)
    count = neighbours_for(freedom, LINES)
    variance = GROWTH * rng.gamma(freedom, 1 / freedom, (LINES, 4000))
    found = pooled_variance(np.ones_like(variance), variance, freedom, count)
    kept = found == variance
    assert kept.mean() < 30 * IMPROBABLE
    logs = np.log(found / GROWTH)[LINES // 3 : -LINES // 3]
    inside = logs[~kept[LINES // 3 : -LINES // 3]]
    spread = special.polygamma(1, freedom) / count
    assert abs(inside.mean()) < 3 * np.sqrt(spread / 4000)
    assert inside.var() == pytest.approx(spread, rel=0.05)


def test_left_out_elements_stay_and_take_no_part() -> None:
    variance = GROWTH.copy()
    variance[[10, 50, 51]] = np.inf
    found = pooled_variance(np.ones((LINES, 1)), variance, 1e6, 12)
    assert np.isinf(found[[10, 50, 51]]).all()
    np.testing.assert_allclose(found, variance, rtol=2e-6)
