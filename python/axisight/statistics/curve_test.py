"""Analysis of variance of curves: compare the difference between groups with that within groups.

The curves may have any correlation along their length, and many more points than there are curves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.statistics.one_way import OneWay

Real = NDArray[np.float64]

# Scatter below this share of the curves is rounding.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class CurveTest:
    """Curves of groups compared as wholes.

    between, within
        Standard deviation of the means of groups beyond chance, and of curves within a group: root mean
        squares along the curve, in the unit of the curves.
    p_value
        Probability of a larger F of the scores without a difference; NaN without repeats or scatter.
    shape
        (n_points,), the shape along which the curves differ most, of length 1.
    """

    between: float
    within: float
    p_value: float
    shape: Real


def curve_test(runs: OneWay) -> CurveTest:
    """Return the comparison of curves ``runs.values`` (n_runs, n_points).

    The score of a curve is its projection on the first principal component of all curves about their common
    mean. The F test of the scores is exact for normal curves of any covariance, because the component does
    not know the groups (Laeuter 1996).
    """
    values = runs.values
    left, size, right = np.linalg.svd(values - values.mean(axis=0), full_matrices=False)
    p_value = float("nan")
    scatters = size[0] > _ROUNDING * np.linalg.norm(values)
    if scatters and min(runs.freedom) > 0:
        p_value = float(OneWay(left[:, :1], runs.group).p_value[0])
    return CurveTest(*runs.rms(), p_value, np.asarray(right[0]))


def independent_values(runs: OneWay) -> float:
    """Return ``trace(C)^2 / trace(C^2)`` of the covariance C along curves within groups, at least 1.

    So many independent values is the scatter of one curve worth (Satterthwaite). Both traces are estimated
    without bias for normal curves (Zhang 2013, section 5.3). With one degree of freedom within groups, or
    without scatter, it is 1, the least.
    """
    n = runs.freedom[1]
    if n < 2:
        return 1.0
    # The products of runs have the same traces of powers as the covariance along the curve.
    gram = runs.residuals @ runs.residuals.T / n
    first, second = float(np.trace(gram)) ** 2, float((gram**2).sum())
    scale = (n - 1) * (n + 2)
    squared_trace = n * (n + 1) / scale * (first - 2.0 * second / (n + 1))
    trace_of_square = n**2 / scale * (second - first / n)
    most = float(runs.values.shape[1])
    if squared_trace <= 0.0:
        return 1.0
    # By chance the estimate of the trace of the square may be zero or less.
    return float(np.clip(squared_trace / max(trace_of_square, squared_trace / most), 1.0, most))
