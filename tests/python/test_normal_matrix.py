"""Inverses of normal matrices: what data do not show stays unknown."""

import numpy as np

from axisight.graybox.normal_matrix import inverse_normal, pseudo_inverse


def test_full_rank_is_the_inverse_whatever_the_units() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(30, 4)) * [1e-6, 1.0, 1e5, 1e9]
    matrix = rows.T @ rows
    inverse, condition = inverse_normal(matrix)
    size = np.sqrt(np.diag(matrix))
    scaled = rows / size
    wanted = np.linalg.inv(scaled.T @ scaled)
    np.testing.assert_allclose(inverse * np.outer(size, size), wanted, rtol=1e-9)
    assert np.isclose(condition, np.linalg.cond(scaled) ** 2, rtol=1e-9)


def test_a_parameter_without_data_is_infinite_and_alone() -> None:
    matrix = np.diag([4.0, 0.0, 9.0])
    inverse, condition = inverse_normal(matrix)
    assert np.isinf(inverse[1, 1]) and np.isinf(condition)
    np.testing.assert_allclose(inverse[[0, 2], [0, 2]], [0.25, 1 / 9])


def test_a_matrix_that_is_not_finite_shows_nothing() -> None:
    matrix = np.array([[1.0, np.nan], [np.nan, np.inf]])
    inverse, condition, blind = pseudo_inverse(matrix)
    assert np.isinf(inverse).all() and np.isinf(condition) and blind.all()
