"""Weights for lines whose variance comes from few realizations.

A sample variance with nu complex degrees of freedom scatters; a weight 1 / variance scatters more.
Weighing every line by its own makes a least-squares estimate vary nu / (nu - 2) times more than
the weights claim, without bound from three realizations. So a line is weighed by what its
neighbours say, and its own variance is kept for the covariance of the estimate. Where variances
of lines are independent, so are both, and this covariance is right however badly neighbours
resemble each other. Variances that share data (of smoothed responses, local models) are not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from axisight.errors import InputError

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
FEW_FREEDOM = 10.0
"""Degrees of freedom beyond the elements weighed together: with fewer, `OwnWeights` is uncertain."""
MISFIT_EXPLAINED = 1.1
"""Residuals larger than the variance explains by this factor: the model is incomplete."""


def neighbours_for(
    degrees_of_freedom: float | None, n_lines: int, wanted: int | None = None
) -> int:
    """Return how many neighbours say the weight of a line, 0 if it is its own variance.

    degrees_of_freedom
        Complex, of a line's variance; None if it is known.
    n_lines
        That there are.
    wanted
        By the user: 0 or an even number from 4. None: as many as make 30 degrees of freedom, at
        most a third of the lines, none for a known variance or one of 30.

    Raises InputError for another number, and one that cannot be had.
    """
    if wanted is not None:
        check_neighbours(wanted)
        if wanted >= n_lines:
            raise InputError(f"neighbours: expected fewer than the {n_lines} lines, got {wanted}")
        return 0 if degrees_of_freedom is None else wanted
    if degrees_of_freedom is None or degrees_of_freedom >= ENOUGH_FREEDOM:
        return 0
    scatter = float(special.polygamma(1, degrees_of_freedom))
    half = max(int(np.ceil(0.5 * ENOUGH_FREEDOM * scatter)), FEWEST_NEIGHBOURS // 2)
    count = 2 * min(half, n_lines // (2 * LARGEST_SHARE))
    return count if count >= FEWEST_NEIGHBOURS else 0


def check_neighbours(wanted: int | None) -> None:
    """Refuse a number of neighbours that is none."""
    if wanted is None:
        return
    whole = isinstance(wanted, int | np.integer) and not isinstance(wanted, bool)
    if not whole or not (wanted == 0 or (wanted >= FEWEST_NEIGHBOURS and wanted % 2 == 0)):
        raise InputError(
            f"neighbours: expected None, 0 or an even number from {FEWEST_NEIGHBOURS}, "
            f"got {wanted!r}"
        )


@dataclass(frozen=True)
class OwnWeights:
    """What weights from a line's own estimated variance do to a fit.

    ``misfit``: mean square of whitened residuals. ``variance``: factor on the covariance of the
    parameters that the weights claim. NaN where they have no bound; both are uncertain if ``few``.
    """

    misfit: float = 1.0
    variance: float = 1.0
    few: bool = False

    @classmethod
    def of(cls, degrees_of_freedom: float | None, elements: int = 1) -> OwnWeights:
        """Return the moments of an inverse complex Wishart matrix of so many ``elements``.

        ``degrees_of_freedom`` nu: nu / (nu - p) and nu^2 / ((nu - p)^2 - 1).
        """
        if degrees_of_freedom is None:
            return cls()
        nu, left = degrees_of_freedom, degrees_of_freedom - elements
        return cls(
            misfit=nu / left if left > 0 else np.nan,
            variance=nu**2 / (left**2 - 1) if left > 1 else np.nan,
            few=left < FEW_FREEDOM,
        )


def few_words(degrees_of_freedom: float) -> str:
    """Return what to say of lines weighed by their own variance of few degrees of freedom."""
    return (
        f"lines are weighed by their own variance of {degrees_of_freedom:.3g} degrees of freedom: "
        "use neighbours=None if it is 0, more lines, or more realizations"
    )


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
    the 1 - 1e-6 quantile of F(2 nu, 2 x 30) keeps its own variance. ``degrees_of_freedom`` above
    zero and ``neighbours`` as from `neighbours_for`, which checks.
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
