"""Least squares with parameters that drift: square-root information filter and its smoother.

Bierman, *Factorization Methods for Discrete Sequential Estimation* (1977), chapters V and X. For linear models this
is the Kalman filter and the smoother of Rauch, Tung and Striebel. Triangular factors keep covariances positive, and
parameters may be unknown at first.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

Array = NDArray[np.float64]

# A parameter is known once no singular value of the information, scaled to unit columns, is smaller.
_KNOWN = 1e-9


@dataclass(frozen=True, eq=False)
class Track:
    """Parameters at the end of each block, (n_blocks, k), and their covariances, (n_blocks, k, k).

    ``filtered`` uses the blocks up to each time, ``smoothed`` all blocks. Filtered values are NaN until the data
    determine all parameters.
    """

    filtered: Array
    filtered_covariance: Array
    smoothed: Array
    smoothed_covariance: Array


def random_walk(blocks: Iterable[Array], drift: Array) -> Track:
    """Return parameters that change by a random walk between blocks of equations of unit noise.

    ``blocks``: per block the rows ``[Phi | y]`` (n, k + 1) of ``y = Phi x + e`` with e of unit variance; ``drift``
    (k,): standard deviation of the change of each parameter between blocks, zero for constants. The cost is of order
    k^3 per block. Raises LinAlgError if all blocks together do not determine the parameters.
    """
    size = len(drift)
    moving = np.flatnonzero(drift > 0)
    information = np.zeros((size, size + 1))
    known, steps = [], []
    for number, block in enumerate(blocks):
        if number:
            information, step = _predicted(information, drift, moving)
            steps.append(step)
        information = _triangle(np.concatenate([information, block]), size)
        known.append(information)
    filtered = [_values(x) for x in known]
    smoothed = [filtered[-1]]
    if np.isnan(smoothed[0][0]).any():
        raise np.linalg.LinAlgError("the blocks do not determine all parameters")
    for step in reversed(steps):
        smoothed.append(_smoothed(step, smoothed[-1], moving))
    smoothed.reverse()
    return Track(*(np.array(x) for pairs in (filtered, smoothed) for x in zip(*pairs, strict=True)))


def _triangle(rows: Array, size: int) -> Array:
    """Return the first ``size`` rows of the triangular factor, with zero rows if there are fewer."""
    factor = np.linalg.qr(rows, mode="r")[:size]
    return np.concatenate([factor, np.zeros((size - len(factor), rows.shape[1]))])


def _predicted(information: Array, drift: Array, moving: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return the information after a step of the walk, and the equations of its change for the smoother.

    Unknowns are the changes w of the ``moving`` parameters and the new parameters x' = x + w.
    """
    size, count = len(drift), len(moving)
    before = np.concatenate([-information[:, moving], information], axis=1)
    walk = np.zeros((count, count + size + 1))
    walk[:, :count] = np.diag(1.0 / drift[moving])
    factor = _triangle(np.concatenate([walk, before]), count + size)
    return factor[count:, count:], factor[:count]


def _values(information: Array) -> tuple[Array, Array]:
    """Return the parameters and their covariance; NaN where the information does not determine all of them."""
    size = len(information)
    root, right = information[:, :size], information[:, size]
    length = np.linalg.norm(root, axis=0)
    if not length.all() or np.linalg.svd(root / length, compute_uv=False)[-1] < _KNOWN:
        return np.full(size, np.nan), np.full((size, size), np.nan)
    inverse = solve_triangular(root, np.eye(size))
    return inverse @ right, inverse @ inverse.T


def _smoothed(
    step: Array, after: tuple[Array, Array], moving: NDArray[np.intp]
) -> tuple[Array, Array]:
    """Return parameters and covariance before a step from those after it, x = x' - w."""
    count = len(moving)
    values, covariance = after
    size = len(values)
    if not count:
        return after
    root = step[:, :count]
    gain = solve_triangular(root, step[:, count : count + size])
    change = solve_triangular(root, step[:, -1]) - gain @ values
    spread = solve_triangular(root, np.eye(count))
    back = np.eye(size)
    back[moving] += gain
    before = values.copy()
    before[moving] -= change
    covariance = back @ covariance @ back.T
    covariance[np.ix_(moving, moving)] += spread @ spread.T
    return before, covariance
