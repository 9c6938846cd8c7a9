"""Inverse and standard deviations from normal equations that do not have full rank."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Eigenvalue, relative to the largest, below which the data do not determine a direction; and the share of such
# directions in a parameter above which the parameter is undetermined.
_RANK = 1e-10
_UNSEEN = 1e-3


def pseudo_inverse(matrix: Array) -> Array:
    """Return the pseudo-inverse of a positive semidefinite matrix (n, n), independent of the parameters' units."""
    scale = _scale(matrix)
    scaled = matrix * np.outer(scale, scale)
    inverse = np.linalg.pinv(scaled, rcond=_RANK, hermitian=True)
    return np.asarray(inverse * np.outer(scale, scale))


def deviations_seen(matrix: Array, scatter: Array) -> Array:
    """Return the standard deviations (n,) of a sandwich estimate, infinite for undetermined parameters.

    ``matrix`` (n, n): normal equations; ``scatter`` (n, n): scatter of the gradient.
    """
    inverse, scale = pseudo_inverse(matrix), _scale(matrix)
    variance = np.diag(inverse @ scatter @ inverse)
    size, direction = np.linalg.eigh(matrix * np.outer(scale, scale))
    lost = (direction[:, size <= _RANK * size.max(initial=0.0)] ** 2).sum(axis=1)
    return np.where(lost > _UNSEEN, np.inf, np.sqrt(np.maximum(variance, 0.0)))


def _scale(matrix: Array) -> Array:
    size = np.sqrt(np.diag(matrix))
    return np.asarray(np.divide(1.0, size, out=np.zeros_like(size), where=size > 0))
