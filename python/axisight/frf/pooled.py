"""Weights for lines whose variance comes from few realizations.

A sample variance with nu complex degrees of freedom scatters; a weight 1 / variance scatters more.
Weighing every line by its own makes a least-squares estimate vary nu / (nu - 2) times more than
the weights claim, without bound from three realizations. So a line is weighed by what its
neighbours say, and its own variance is kept for the covariance of the estimate: both do not
depend on each other, so that this covariance stays right however well neighbours resemble.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

Real = NDArray[np.float64]

ENOUGH_FREEDOM = 30.0
"""Complex degrees of freedom that weights should rest on: they then cost 1/30 of variance."""
IMPROBABLE = 1e-6
"""A line so far above its neighbours, by chance, keeps its own variance: it is disturbed.

Rarer than what counts as chance elsewhere: where neighbours resemble each other badly, choosing
by the own variance would leave the smaller ones, and too small standard errors."""
FEWEST_NEIGHBOURS = 4
"""A straight line needs that many."""
LARGEST_SHARE = 3
"""One in so many lines at most counts as a neighbour."""


def neighbours_wanted(degrees_of_freedom: float | None, n_lines: int) -> int:
    """Return how many neighbours make the weight of a line sure enough; none for a known variance.

    ``degrees_of_freedom`` are complex, of a line's variance.
    """
    if degrees_of_freedom is None or degrees_of_freedom >= ENOUGH_FREEDOM:
        return 0
    scatter = float(special.polygamma(1, max(degrees_of_freedom, 0.5)))
    half = max(int(np.ceil(0.5 * ENOUGH_FREEDOM * scatter)), FEWEST_NEIGHBOURS // 2)
    return 2 * min(half, n_lines // (2 * LARGEST_SHARE))


def pooled_variance(
    magnitude: Real, variance: Real, degrees_of_freedom: float, neighbours: int
) -> Real:
    """Return variances to weigh lines by, from their neighbours, (n_lines, ...) as ``variance``.

    magnitude
        Of the response, as a model has it: weights by a measured magnitude follow its error.
    variance
        Over lines in ascending order first. One that is infinite or not a number takes no part
        and stays.
    degrees_of_freedom
        Complex, of each variance.
    neighbours
        How many lines to take, half of them on either side; at the ends of the band the
        nearest so many.

    A straight line goes through the logarithms of the neighbours' variances, relative to the
    magnitude where that makes them smoother. The logarithm of a sample variance is low by
    ln nu - psi(nu), which is put right. A line above its neighbours by more than
    the 1 - 1e-6 quantile of F(2 nu, 2 x 30) keeps its own variance.
    """
    shape = variance.shape
    own = variance.reshape(shape[0], -1)
    usable = np.isfinite(own) & (own > 0)
    size = magnitude.reshape(own.shape)
    usable &= size > 0
    level = 2 * np.log(np.where(usable, size, 1.0))
    logs = np.log(np.where(usable, own, 1.0))
    low = np.log(degrees_of_freedom) - special.digamma(degrees_of_freedom)
    absolute = _line_through_neighbours(logs, usable, neighbours)
    relative = _line_through_neighbours(logs - level, usable, neighbours) + level
    smoother = _roughness(logs - level, usable) < _roughness(logs, usable)
    chosen = np.exp(np.where(smoother, relative, absolute) + low)
    limit = stats.f.isf(IMPROBABLE, 2 * degrees_of_freedom, 2 * ENOUGH_FREEDOM)
    kept = ~usable | ~np.isfinite(chosen) | (own > limit * chosen)
    return np.where(kept, own, chosen).reshape(shape)


def _roughness(logs: Real, usable: NDArray[np.bool_]) -> Real:
    """Mean square step from line to line, of every element."""
    both = usable[1:] & usable[:-1]
    steps = np.where(both, np.diff(logs, axis=0), 0.0)
    return np.asarray(np.sum(steps**2, axis=0) / np.maximum(both.sum(axis=0), 1))


def _line_through_neighbours(logs: Real, usable: NDArray[np.bool_], neighbours: int) -> Real:
    """Straight lines fitted to the neighbours, at every line, itself left out; NaN without three."""
    n = len(logs)
    first = np.clip(np.arange(n) - neighbours // 2, 0, n - neighbours - 1)
    places = first[:, None] + np.arange(neighbours + 1)
    apart = places - np.arange(n)[:, None]
    weight = usable[places] & (apart != 0)[..., None]
    x = apart[..., None].astype(np.float64)
    y = logs[places]
    count, x1, x2, y0, xy = (
        np.sum(np.where(weight, v, 0.0), axis=1) for v in (np.ones_like(x), x, x * x, y, x * y)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        at_line = (x2 * y0 - x1 * xy) / (count * x2 - x1**2)
    return np.where(count >= 3, at_line, np.nan)
