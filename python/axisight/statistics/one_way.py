"""Analysis of variance with one factor: compare the difference between groups with that within groups."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

Real = NDArray[np.float64]
Whole = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class OneWay:
    """Repeats of several quantities in groups, for example runs of several days.

    values
        (n_runs, n_quantities).
    group
        Index of the group of each run (n_runs,), from 0 without gaps.

    The variances within groups are taken as equal. Quantities without any scatter have an F of NaN.
    """

    values: Real
    group: Whole

    @cached_property
    def counts(self) -> Whole:
        """Number of runs of each group (n_groups,)."""
        return np.bincount(self.group)

    @cached_property
    def means(self) -> Real:
        """Mean of each group (n_groups, n_quantities)."""
        total = np.zeros((len(self.counts), self.values.shape[1]))
        np.add.at(total, self.group, self.values)
        return np.asarray(total / self.counts[:, None])

    @property
    def freedom(self) -> tuple[int, int]:
        """Degrees of freedom between groups and within groups."""
        return len(self.counts) - 1, len(self.group) - len(self.counts)

    @cached_property
    def residuals(self) -> Real:
        """Values less the mean of their group (n_runs, n_quantities)."""
        return np.asarray(self.values - self.means[self.group])

    @cached_property
    def mean_squares(self) -> tuple[Real, Real]:
        """Mean squares between and within groups, (n_quantities,) each; NaN without degrees of freedom."""
        above, below = self.freedom
        apart = self.means - self.values.mean(axis=0)
        between = (self.counts[:, None] * apart**2).sum(axis=0)
        within = (self.residuals**2).sum(axis=0)
        return (
            between / above if above else np.full_like(between, np.nan),
            within / below if below else np.full_like(within, np.nan),
        )

    @cached_property
    def p_value(self) -> Real:
        """Probability of so large an F without a difference between groups (n_quantities,)."""
        between, within = self.mean_squares
        f = np.divide(between, within, out=np.full_like(between, np.nan), where=within > 0)
        above, below = self.freedom
        return np.asarray(scipy.special.fdtrc(max(above, 1), max(below, 1), f))

    @cached_property
    def components(self) -> tuple[Real, Real]:
        """Variances of group means and of runs within a group, (n_quantities,) each; NaN as `mean_squares`.

        Searle, Casella, McCulloch (1992), section 3.6: the estimate that equates mean squares to their
        expectations, for unequal group sizes; zero where it is negative.
        """
        between, within = self.mean_squares
        if not self.freedom[0]:
            return between, within
        return np.maximum((between - within) / self._typical, 0.0), within

    @property
    def _typical(self) -> float:
        """Runs of a group that count in the variance of group means."""
        n = len(self.group)
        return float(n - (self.counts**2).sum() / n) / self.freedom[0]

    def rms(self) -> tuple[float, float]:
        """Return standard deviations of group means and of runs within a group, rms over the quantities.

        Mean squares are averaged first: zeros in place of negative variances would add up. NaN between the
        means of a single group.
        """
        between, within = (float(np.mean(x)) for x in self.mean_squares)
        if np.isnan(between):
            return between, float(np.sqrt(within))
        apart = max((between - within) / self._typical, 0.0)
        return float(np.sqrt(apart)), float(np.sqrt(within))


def least_shift(counts: Whole, variance: Real, significance: float, power: float) -> Real:
    """Return the smallest shift of one group that the F test finds with probability ``power``.

    The other groups are equal. Of all groups the one that shows a shift worst counts. ``counts``
    (n_groups,), ``variance`` of runs within a group (n_quantities,), ``significance`` the level of the
    test. The result is (n_quantities,), infinite without repeats.
    """
    above, below = len(counts) - 1, int(counts.sum()) - len(counts)
    if above < 1 or below < 1:
        return np.full_like(variance, np.inf)
    limit = float(scipy.special.fdtri(above, below, 1.0 - significance))
    low, high = 0.0, 1.0
    while scipy.special.ncfdtr(above, below, high, limit) > 1.0 - power:
        low, high = high, 2.0 * high
    wanted = scipy.optimize.brentq(
        lambda nc: scipy.special.ncfdtr(above, below, nc, limit) - (1.0 - power), low, high
    )
    return np.sqrt(wanted * variance / _shown(counts))


def power_of_shift(counts: Whole, variance: Real, significance: float, shift: Real) -> Real:
    """Return the probability (n_quantities,) with which the F test finds a ``shift`` of one group.

    Arguments as of :func:`least_shift`; ``shift`` is (n_quantities,).
    """
    above, below = len(counts) - 1, int(counts.sum()) - len(counts)
    if above < 1 or below < 1:
        return np.zeros_like(variance)
    limit = float(scipy.special.fdtri(above, below, 1.0 - significance))
    noncentral = _shown(counts) * shift**2 / np.maximum(variance, 1e-300)
    # Beyond this the distribution function no longer converges, and the power is 1.
    sure = noncentral > 1e5
    found = 1.0 - scipy.special.ncfdtr(above, below, np.minimum(noncentral, 1e5), limit)
    return np.where(sure, 1.0, found)


def _shown(counts: Whole) -> float:
    """Return the noncentrality of a shift of one standard deviation of the group that shows it worst."""
    return float((counts * (1.0 - counts / counts.sum())).min())
