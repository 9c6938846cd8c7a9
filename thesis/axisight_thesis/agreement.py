"""Agreement of a published table with realizations of the same table.

The thesis publishes one realization of each table of chapter 8. Its entries therefore differ from the
mean of other realizations even on the same robot. The tolerances here are what single realizations of
this study show against the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from axisight.statistics.intervals import student_factor
from axisight_thesis.decision import PROBABILITY

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """Comparison of the logarithms of a published table with those of realizations.

    factor
        Ratio of published entry and geometric mean of the realizations, or its inverse, at least 1.
    correlation
        Correlation of the logarithms over entries.
    own_correlation
        The lowest such correlation of a realization with the mean of the others.
    outside
        Mask of entries outside the 95 % prediction interval of one realization (Student's t).
    allowed
        The number of entries that are outside with a probability above 5 % although all is equal.
    """

    factor: Real
    correlation: float
    own_correlation: float
    outside: NDArray[np.bool_]
    allowed: int

    @classmethod
    def of(cls, published: ArrayLike, realizations: ArrayLike) -> Agreement:
        """Return the agreement of positive entries (...) with realizations (realization, ...)."""
        wanted, found = (
            np.log(np.asarray(published, float)),
            np.log(np.asarray(realizations, float)),
        )
        count = len(found)
        mean = found.mean(axis=0)
        width = float(student_factor(PROBABILITY, count - 1)) * np.sqrt(1 + 1 / count)
        others = (count * mean - found) / (count - 1)
        own = [_correlation(a, b) for a, b in zip(found, others, strict=True)]
        return cls(
            factor=np.exp(np.abs(wanted - mean)),
            correlation=_correlation(wanted, mean),
            own_correlation=min(own),
            outside=np.asarray(np.abs(wanted - mean) > width * found.std(axis=0, ddof=1)),
            allowed=int(stats.binom.ppf(PROBABILITY, wanted.size, 1 - PROBABILITY)),
        )

    @property
    def scattered(self) -> bool:
        """Whether no more entries are outside the interval than chance explains."""
        return int(self.outside.sum()) <= self.allowed

    @property
    def alike(self) -> bool:
        """Whether the published table correlates as well as a realization does with the others."""
        return self.correlation >= self.own_correlation

    def factors(self) -> str:
        """Return worst and median factor as text."""
        return f"largest factor {self.factor.max():.2f}, median {np.median(self.factor):.2f}"

    def intervals(self) -> str:
        """Return the count of entries outside the interval as text."""
        return (
            f"{int(self.outside.sum())} of {self.outside.size} entries are outside the 95 % interval "
            f"of one realization; chance allows {self.allowed}"
        )

    def correlations(self) -> str:
        """Return the correlations as text."""
        return (
            f"correlation of logarithms {self.correlation:.3f}; realizations correlate with the mean "
            f"of the others by {self.own_correlation:.3f} or more"
        )


def _correlation(a: Real, b: Real) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])
