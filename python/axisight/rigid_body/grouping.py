"""Dependent columns of a matrix, grouped with the ones they depend on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grouping:
    """A basis of the columns of a matrix A, and the other columns in terms of it.

    independent
        Indices of the columns of the basis, increasing.
    matrix
        Shape (rank, n): ``A x = A[:, independent] (matrix @ x)``.
    scaled
        A with columns of unit length; skipped and zero columns are zero.
    singular_values, rank, gap
        Those of the scaled matrix.
    """

    independent: NDArray[np.intp]
    matrix: Array
    scaled: Array
    singular_values: Array
    rank: int
    gap: float


def group(a: Array, tolerance: float, skip: NDArray[np.bool_] | None = None) -> Grouping:
    """Return the columns of ``a`` grouped from left to right.

    ``tolerance`` is relative, for columns of unit length. Columns marked by ``skip`` count as zero.
    """
    size = np.linalg.norm(a, axis=0)
    used = size > 0
    if skip is not None:
        used &= ~skip
    scaled = np.where(used, a / np.where(used, size, 1.0), 0.0)
    values = np.linalg.svd(scaled, compute_uv=False)
    rank = int((values > tolerance * values.max(initial=0.0)).sum())
    rest = values[rank:] if rank < len(values) else np.zeros(0)
    gap = float(values[rank - 1] / rest[0]) if rank and rest.any() else float("inf")
    independent = _basis(scaled, used, tolerance)
    basis = scaled[:, independent]
    weights = np.linalg.lstsq(basis, scaled, rcond=None)[0] if len(independent) else basis.T
    # Smaller coefficients are rounding errors of the decomposition.
    weights[np.abs(weights) < 1e-9] = 0.0
    weights[:, independent] = np.eye(len(independent))
    matrix = weights * np.where(used, size, 0.0) / size[independent][:, None]
    matrix[:, independent] = np.eye(len(independent))
    return Grouping(independent, matrix, scaled, values, rank, gap)


def _basis(scaled: Array, used: NDArray[np.bool_], tolerance: float) -> NDArray[np.intp]:
    """Return the columns independent of earlier ones, by Gram-Schmidt, repeated for orthogonality."""
    basis = np.zeros((len(scaled), 0))
    found = []
    # The remainder of a dependent column is rounding, amplified if the basis is nearly dependent. The
    # remainder of an independent column is about the smallest singular value.
    for i in np.flatnonzero(used):
        rest = scaled[:, i]
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        size = np.linalg.norm(rest)
        if size > tolerance:
            found.append(i)
            basis = np.column_stack([basis, rest / size])
    return np.array(found, dtype=np.intp)
