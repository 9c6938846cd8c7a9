"""States of a linear model at every sample, by linear algebra instead of a loop over samples.

``x(t + 1) = A x(t) + v(t)`` at all samples together is one system of equations, unit lower
triangular and banded: LAPACK solves it by forward substitution, which is the recursion itself.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from axisight.blackbox._data import Real

BAND_NUMBERS = 1 << 17
"""Entries of the band in one block, so that the band stays in the cache."""


def states(a: Real, drive: Real, start: Real) -> Real:
    """Return x(0) to x(n_samples), shape (n_samples + 1, n_states, n_columns).

    a
        (n_states, n_states).
    drive
        v(t), (n_samples, n_states, n_columns); every column is a separate motion.
    start
        x(0), (n_states, n_columns).
    """
    n, samples = len(a), len(drive)
    out = np.empty((samples + 1, *start.shape))
    out[0] = start
    if n == 0 or samples == 0:
        return out
    block = min(samples, max(1, BAND_NUMBERS // (2 * n * n)))
    # Banded storage: one on the diagonal, -A in the rows of the next sample.
    one = np.zeros((2 * n, n))
    one[0] = 1.0
    row, column = np.indices((n, n))
    one[n + row - column, column] = -a
    band = np.tile(one.T, (block + 1, 1)).T
    for first in range(0, samples, block):
        v = drive[first : first + block]
        right = np.concatenate([out[first : first + 1], v]).reshape(-1, start.shape[1])
        size = len(right)
        found, _ = lapack.dtbtrs(band[:, :size], right, uplo="L", diag="U")
        out[first : first + len(v) + 1] = found.reshape(-1, *start.shape)
    return out
