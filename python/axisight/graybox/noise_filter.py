"""Autoregressive noise filters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

from axisight.statistics.correlation import pooled_autocovariance

Array = NDArray[np.float64]


def estimate_filter(parts: Sequence[Array], order: int | None, most: int) -> Array:
    """Return a_1..a_p of ``A(q) = 1 + a_1 q^-1 + ...``, one whitening filter for all parts.

    It solves the Yule-Walker equations on the mean autocovariance, whose solution is always stable
    and minimum phase. Without ``order`` it takes the order up to ``most`` with the smallest Akaike
    criterion ``n log(variance) + 2 p``.
    """
    count = sum(len(p) for p in parts)
    most = min(most if order is None else order, min(len(p) for p in parts) - 1, count // 10)
    covariance = pooled_autocovariance(parts, most) / count
    if covariance[0] <= 0 or most < 1:
        return np.zeros(0)
    # A floor of white noise at rounding level keeps rounding errors from deciding the filter.
    covariance[0] *= 1 + 1e-10

    def solved(p: int) -> tuple[Array, float]:
        a = solve_toeplitz(covariance[:p], -covariance[1 : p + 1])
        return a, float(covariance[0] + covariance[1 : p + 1] @ a)

    if order is not None:
        return np.asarray(solved(most)[0])
    candidates = [solved(p) for p in range(1, most + 1)]
    scores = [count * np.log(max(v, 1e-300)) + 2 * p for p, (_, v) in enumerate(candidates, 1)]
    best = int(np.argmin(scores))
    white = count * np.log(covariance[0])
    return np.zeros(0) if white <= scores[best] else np.asarray(candidates[best][0])
