"""What several kinds of fits share: scaled least squares, intervals, scatter, correlation, starts."""

import numpy as np
import pytest
import scipy.linalg
from scipy import stats

from axisight.errors import InputError
from axisight.statistics.cluster_scatter import ClusterScatter
from axisight.statistics.correlation import (
    covariance_spread,
    covariances,
    joint_p_value,
    pooled_autocovariance,
    whiteness_p_value,
)
from axisight.statistics.intervals import student_factor, student_interval
from axisight.statistics.least_squares import (
    condition,
    inverse_root,
    scaled_solution,
    unit_columns,
)
from axisight.statistics.starts import StartRange, drawn_start


def test_units_of_the_unknowns_decide_nothing() -> None:
    rng = np.random.default_rng(0)
    matrix, target = rng.normal(size=(30, 4)), rng.normal(size=30)
    units = np.array([1e-12, 1.0, 1e9, 1e-3])
    want = np.linalg.lstsq(matrix, target)[0]
    found = scaled_solution(matrix * units, target, 1e-13)
    np.testing.assert_allclose(found * units, want, rtol=1e-12)
    assert condition(matrix * units) == pytest.approx(condition(matrix), rel=1e-12)
    root = inverse_root(matrix * units, 1e-10)
    assert root is not None
    inverse = np.linalg.inv(matrix.T @ matrix)
    np.testing.assert_allclose(root @ root.T * np.outer(units, units), inverse, atol=1e-12)


def test_columns_that_show_nothing() -> None:
    rng = np.random.default_rng(1)
    matrix = np.column_stack([rng.normal(size=(20, 2)), np.zeros(20)])
    unit, size = unit_columns(matrix)
    np.testing.assert_allclose(np.linalg.norm(unit, axis=0), [1, 1, 0], atol=1e-15)
    assert size[2] == 1.0 and np.isinf(condition(matrix))
    assert inverse_root(matrix, 1e-10) is None
    assert inverse_root(matrix[:, [0, 1, 0]], 1e-10) is None
    # The shortest solution leaves what has no effect at zero, and shares what is told twice.
    found = scaled_solution(matrix[:, [0, 1, 2, 0]], matrix[:, 0], 1e-10)
    np.testing.assert_allclose(found, [0.5, 0, 0, 0.5], atol=1e-14)


def test_student_intervals() -> None:
    """Quantiles of the printed tables: 2.776 for four degrees of freedom, 1.960 for all."""
    np.testing.assert_allclose(student_factor(0.95, [4, np.inf]), [2.776, 1.960], atol=5e-4)
    low, high = student_interval(np.array([1.0, -2.0]), np.array([0.5, 0.1]), [4.0, np.inf], 0.95)
    np.testing.assert_allclose(low, [1 - 2.776 / 2, -2 - 0.196], atol=5e-4)
    np.testing.assert_allclose(high, [1 + 2.776 / 2, -2 + 0.196], atol=5e-4)
    for level in (0.0, 1.0, -0.5, np.nan):
        with pytest.raises(InputError, match="level: expected a number between 0 and 1"):
            student_factor(level, 3)


def scatter(rows: np.ndarray, target: np.ndarray) -> ClusterScatter:
    """Of least squares of rows (n_clusters, n_equations, n) and their right sides."""
    n = rows.shape[-1]
    _, r = np.linalg.qr(rows.reshape(-1, n))
    root = np.linalg.inv(r)
    values = np.linalg.lstsq(rows.reshape(-1, n), target.ravel())[0]
    return ClusterScatter(root, rows @ root, rows @ values - target)


def test_scatter_is_that_of_the_definition() -> None:
    rng = np.random.default_rng(2)
    rows, target = rng.normal(size=(9, 4, 3)), rng.normal(size=(9, 4))
    found = scatter(rows, target)
    inverse = np.linalg.inv(np.einsum("bij,bik->jk", rows, rows))
    want = np.zeros((3, 3))
    for part, left in zip(rows, found.residual, strict=True):
        enlarge = np.linalg.inv(scipy.linalg.sqrtm(np.eye(4) - part @ inverse @ part.T))
        change = inverse @ part.T @ enlarge @ left
        want += np.outer(change, change)
    np.testing.assert_allclose(found.covariance, want, rtol=0, atol=1e-12 * np.abs(want).max())


def test_the_mean_of_clusters_has_their_number_less_one() -> None:
    """A mean of k clusters of one size: variance of their means over k, k - 1 degrees of freedom."""
    target = np.random.default_rng(3).normal(size=(6, 5))
    found = scatter(np.ones((6, 5, 1)), target)
    want = np.var(target.mean(axis=1), ddof=1) / 6
    assert found.covariance[0, 0] == pytest.approx(want, rel=1e-12)
    assert found.degrees_of_freedom[0] == pytest.approx(5.0, rel=1e-12)
    assert found.shown.all()


def test_a_parameter_of_one_cluster_shows_no_scatter() -> None:
    rng = np.random.default_rng(4)
    rows = rng.normal(size=(8, 3, 2))
    rows[:, :, 1] = 0.0
    rows[5, 1, 1] = 7.0
    found = scatter(rows, rng.normal(size=(8, 3)))
    assert found.shown.tolist() == [True, False]
    assert np.isnan(found.covariance[1]).all() and np.isnan(found.covariance[0, 1])
    assert found.covariance[0, 0] > 0
    assert found.degrees_of_freedom[0] > 4 and found.degrees_of_freedom[1] == 0


def test_covariances_are_sums_over_time() -> None:
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(2, 40))
    want = [x[lag:] @ y[: 40 - lag] / 40 for lag in range(40)]
    np.testing.assert_allclose(covariances(x, y, 39), want, atol=1e-15)
    np.testing.assert_allclose(covariances(x, y, 3), want[:4], atol=1e-15)
    parts = [x, y[:3]]
    want = [sum(p[lag:] @ p[: max(len(p) - lag, 0)] for p in parts) for lag in range(6)]
    np.testing.assert_allclose(pooled_autocovariance(parts, 5), want, atol=1e-13)


def test_spread_is_the_sum_over_both_covariances() -> None:
    rng = np.random.default_rng(6)
    first, second = rng.normal(size=4), rng.normal(size=6)
    for lag, found in enumerate(covariance_spread(first, second, 3)):
        want = sum(first[abs(k)] * second[abs(k + lag)] for k in range(-3, 4))
        assert found == pytest.approx(want, abs=1e-14)


def test_p_values_are_even_where_there_is_nothing() -> None:
    """1000 draws: shares below 0.1, 0.5 and 0.9 within three deviations, 0.05 at most."""
    rng = np.random.default_rng(7)
    spread = 0.8 ** np.arange(7)
    lags = np.arange(-3, 4)
    draws = np.linalg.cholesky(spread[np.abs(lags[:, None] - lags)]) @ rng.normal(size=(7, 1000))
    joint = [joint_p_value(d, lags, spread, 1e-6) for d in draws.T]
    n = 400
    noise = rng.normal(size=(1000, n))
    rho = np.stack([covariances(e, e, 20) for e in noise])
    for p in (
        np.array(joint),
        whiteness_p_value(rho[:, 1:] / rho[:, :1], n, short=True),
        whiteness_p_value(rho[:, 1:] / rho[:, :1], n, short=False),
    ):
        for level in (0.1, 0.5, 0.9):
            assert np.mean(p < level) == pytest.approx(level, abs=0.05)


def test_directions_without_spread_carry_no_test() -> None:
    lags = np.arange(4)
    # A constant input: all lags are one and the same.
    same = joint_p_value(np.full(4, 1.5), lags, np.ones(4), 1e-6)
    assert same == pytest.approx(stats.chi2.sf(1.5**2, 1), rel=1e-9)
    assert np.isnan(joint_p_value(np.zeros(4), lags, np.zeros(4), 1e-6))


def test_starts_depend_on_seed_and_number_alone() -> None:
    ranges = [
        StartRange(1e-3, 10.0, True, (-np.inf, np.inf)),
        None,
        StartRange(-4.0, -1.0, True, (-2.0, -1.5)),
        StartRange(-1.0, 3.0, False, (-np.inf, np.inf)),
    ]
    middle = [0.1, 7.0, -1.8, 1.0]
    shares = np.random.default_rng([5, 2]).random(4)
    found = drawn_start(middle, ranges, 5, 2)
    want = [1e-3 * 1e4 ** shares[0], 7.0, np.clip(-4 * 0.25 ** shares[2], -2, -1.5)]
    np.testing.assert_allclose(found, [*want, -1 + 4 * shares[3]], rtol=1e-14)
    assert found != drawn_start(middle, ranges, 5, 3)
    # One that stays changes nothing for the others.
    assert drawn_start(middle, [ranges[0], *ranges[1:3], None], 5, 2)[:3] == found[:3]
    many = np.array([drawn_start(middle, ranges, 0, k) for k in range(200)])
    assert (many[:, 2] <= -1.5).all() and (many[:, 2] >= -2).all()
    # Half of the logarithms below the middle: 0.5 +- 3 sqrt(0.25 / 200).
    assert np.mean(many[:, 0] < 0.1) == pytest.approx(0.5, abs=0.11)
