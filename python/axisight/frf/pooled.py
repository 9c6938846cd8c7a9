"""Weights for lines whose variance comes from few realizations.

A sample variance with nu complex degrees of freedom scatters, and a weight 1 / variance scatters more.
If every line is weighted by its own variance, a least-squares estimate varies nu / (nu - 2) times more
than the weights claim, without bound for three realizations. Therefore the neighbours of a line set
its weight, and its own variance only enters the covariance of the estimate. If the variances of lines
are independent, weight and own variance are too, and this covariance is right even if neighbours
differ. Variances that share data (of smoothed responses or local models) are not independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from axisight.errors import InputError

Real = NDArray[np.float64]

ENOUGH_FREEDOM = 30.0
"""Complex degrees of freedom that weights should have; they then cost 1/30 of the variance."""
IMPROBABLE = 1e-6
"""A line whose variance has this probability by chance, or less, is disturbed and keeps its own variance.

The probability is lower than elsewhere. If neighbours differ, choosing by the own variance would keep
the smaller variances and make standard errors too small."""
FEWEST_NEIGHBOURS = 4
"""Fewest neighbours that determine a straight line well."""
LARGEST_SHARE = 3
"""At most one line in this many counts as a neighbour."""
FEW_FREEDOM = 10.0
"""Degrees of freedom beyond the jointly weighted elements; with fewer, `OwnWeights` is uncertain."""
MISFIT_EXPLAINED = 1.1
"""The model is incomplete if residuals exceed what the variance explains by this factor."""


def neighbours_for(
    degrees_of_freedom: float | None, n_lines: int, wanted: int | None = None
) -> int:
    """Return the number of neighbours that set the weight of a line, 0 for its own variance.

    degrees_of_freedom
        Complex degrees of freedom of a line's variance; None if the variance is known.
    n_lines
        Number of lines.
    wanted
        The user's choice: 0 or an even number from 4. None: enough for 30 degrees of freedom
        together, at most a third of the lines; 0 if the variance is known or has 30 itself.

    Raises InputError for another number, and for more neighbours than there are lines.
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
    """Raise InputError unless ``wanted`` is None, 0 or an even number from 4."""
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
    """Corrections to a fit whose lines are weighted by their own estimated variances.

    ``misfit`` is the mean square of whitened residuals, and ``variance`` the factor on the nominal
    covariance of the parameters. They are NaN without a bound, and uncertain if ``few``.
    """

    misfit: float = 1.0
    variance: float = 1.0
    few: bool = False

    @classmethod
    def of(cls, degrees_of_freedom: float | None, elements: int = 1) -> OwnWeights:
        """Return the corrections, which are moments of an inverse complex Wishart matrix.

        With p ``elements`` and nu ``degrees_of_freedom``: nu / (nu - p) and nu^2 / ((nu - p)^2 - 1).
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
    """Return a warning for lines weighted by their own variance with few degrees of freedom."""
    return (
        f"lines are weighed by their own variance of {degrees_of_freedom:.3g} degrees of freedom: "
        "use neighbours=None if it is 0, more lines, or more realizations"
    )


def pooled_variance(
    magnitude: Real, variance: Real, degrees_of_freedom: float, neighbours: int
) -> Real:
    """Return variances for weights, each from the neighbours of its line, shaped as ``variance``.

    magnitude
        Magnitude of the response, preferably from a model, because weights from a measured magnitude
        follow its error.
    variance
        (n_lines, ...), lines ascending. Values that are infinite or NaN take no part and stay.
    degrees_of_freedom
        Complex degrees of freedom of each variance, above zero.
    neighbours
        Number of neighbours, half of them on either side, or the nearest ones at the ends of the band;
        `neighbours_for` gives it and checks it.

    The pooled variance is a straight-line fit to the logarithms of the neighbours' variances, relative
    to the magnitude if that makes them smoother. The fit corrects the bias ln nu - psi(nu) of the
    logarithm of a sample variance. A line above its neighbours by more than the 1 - 1e-6 quantile of
    F(2 nu, 2 x 30) keeps its own variance.
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
    """Return the mean square step from line to line, for every element."""
    both = usable[1:] & usable[:-1]
    steps = np.where(both, np.diff(logs, axis=0), 0.0)
    return np.asarray(np.sum(steps**2, axis=0) / np.maximum(both.sum(axis=0), 1))


def _line_through_neighbours(logs: Real, usable: NDArray[np.bool_], neighbours: int) -> Real:
    """Return straight-line fits to the neighbours of every line, without the line; NaN with fewer than 3."""
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
