"""Inverse of the normal matrix of least squares, infinite for parameters that data do not show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def inverse_normal(matrix: Array) -> tuple[Array, float]:
    """Return the inverse of a normal matrix and its condition number when scaled to unit diagonal.

    The inverse is infinite for parameters that the data do not show; the condition is then infinite.
    """
    inverse, condition, blind = pseudo_inverse(matrix)
    inverse[np.ix_(blind, blind)] = np.inf
    return inverse, condition


def pseudo_inverse(matrix: Array) -> tuple[Array, float, NDArray[np.bool_]]:
    """Return the pseudo-inverse, the condition number, and which parameters data do not show.

    The matrix scaled to unit diagonal decides which directions the data show; if any is missing, the
    condition is infinite. A matrix that is not finite, from a model that nearly diverges, shows none.
    """
    root, condition, blind = pseudo_root(matrix)
    return root @ root.T, condition, blind


def pseudo_root(matrix: Array) -> tuple[Array, float, NDArray[np.bool_]]:
    """Return W with ``W W^T`` the pseudo-inverse, and condition and parameters of `pseudo_inverse`."""
    if not np.isfinite(matrix).all():
        return np.full_like(matrix, np.inf), np.inf, np.ones(len(matrix), bool)
    size = np.sqrt(np.diag(matrix))
    size[size == 0] = 1.0
    unit = matrix / np.outer(size, size)
    values, vectors = np.linalg.eigh(unit)
    seen = values > 1e-15 * len(values)
    condition = float(values[-1] / values[0]) if seen.all() else np.inf
    weights = np.where(seen, 1 / np.where(seen, values, 1.0), 0.0)
    # A direction without data has no finite variance.
    blind = np.abs(vectors[:, ~seen]).max(axis=1, initial=0.0) > 1e-3
    return vectors * np.sqrt(weights) / size[:, None], condition, blind
