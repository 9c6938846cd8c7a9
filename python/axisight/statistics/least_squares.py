"""Least squares with columns of unit length, so that results do not depend on the units of unknowns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


def unit_columns(matrix: Real) -> tuple[Real, Real]:
    """Return ``matrix`` (m, n) with columns of unit length, and the original lengths (n,).

    A column of zeros stays zero, with the length one.
    """
    size = np.linalg.norm(matrix, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.asarray(matrix / size), np.asarray(size)


def scaled_solution(matrix: Real, target: Real, tolerance: float) -> Real:
    """Return x (n,) with the least ``|matrix x - target|``, and of those the shortest for unit columns.

    matrix, target
        (m, n) and (m,).
    tolerance
        Directions whose singular value, for unit columns, is below this share of the largest are
        ignored.
    """
    unit, size = unit_columns(matrix)
    return np.asarray(np.linalg.lstsq(unit, target, rcond=tolerance)[0] / size)


def inverse_root(matrix: Real, tolerance: float) -> Real | None:
    """Return R (n, n) with ``R R^T = (matrix^T matrix)^-1``, or None without an inverse.

    matrix
        (m, n), m at least n.
    tolerance
        There is no inverse if the least singular value, for unit columns, is at most this share of the
        largest.
    """
    unit, size = unit_columns(matrix)
    _, values, directions = np.linalg.svd(unit, full_matrices=False)
    if values[-1] <= tolerance * values[0]:
        return None
    return np.asarray(directions.T / values / size[:, None])


def condition(matrix: Real) -> float:
    """Return the condition number of ``matrix`` (m, n) with columns of unit length."""
    return float(np.linalg.cond(unit_columns(matrix)[0]))
