"""Confidence intervals by Student's distribution."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError

Real = NDArray[np.float64]

NORMAL_DEVIATIONS = 1.96
"""Standard deviations that an interval of 95 % of a normal distribution is to either side."""


def student_factor(level: float, degrees_of_freedom: ArrayLike) -> Real:
    """Return how many standard errors an interval of a ``level`` reaches to either side.

    ``degrees_of_freedom`` of the standard error, infinite where it is known; the result has their
    shape. Raises InputError for a level that is none.
    """
    if not 0 < level < 1:
        raise InputError(f"level: expected a number between 0 and 1, got {level!r}")
    freedom = np.asarray(degrees_of_freedom, np.float64)
    return np.asarray(scipy.special.stdtrit(freedom, 0.5 + 0.5 * level))


def student_interval(
    values: Real, standard_error: Real, degrees_of_freedom: ArrayLike, level: float
) -> tuple[Real, Real]:
    """Return the bounds of the intervals of a ``level``, (n,) each.

    ``values`` and ``standard_error`` are (n,), ``degrees_of_freedom`` one number or (n,). Raises
    InputError for a level that is none.
    """
    half = student_factor(level, degrees_of_freedom) * standard_error
    return values - half, values + half
