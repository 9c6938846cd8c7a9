"""Control of the probability of any false finding among several tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


def holm(p_values: Real) -> Real:
    """Return adjusted p-values (n,), which a level for the whole family is compared with (Holm 1979).

    No assumption on the dependence of the tests. Tests without a p-value (NaN) do not count and stay NaN.
    """
    out = np.full(len(p_values), np.nan)
    known = np.flatnonzero(np.isfinite(p_values))
    order = known[np.argsort(p_values[known], kind="stable")]
    steps = np.arange(len(order), 0, -1) * p_values[order]
    out[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return out
