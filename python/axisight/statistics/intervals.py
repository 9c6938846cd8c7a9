"""Confidence intervals by Student's distribution."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError

Real = NDArray[np.float64]

NORMAL_DEVIATIONS = 1.96
"""Half width of the 95 % interval of a normal distribution, in standard deviations."""


def student_factor(level: float, degrees_of_freedom: ArrayLike) -> Real:
    """Return the half width of an interval with probability ``level``, in standard errors.

    ``degrees_of_freedom`` are those of the standard error, infinite for a known one; the result has
    their shape. Raises InputError for a level that is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(f"level: expected a number between 0 and 1, got {level!r}")
    freedom = np.asarray(degrees_of_freedom, np.float64)
    return np.asarray(scipy.special.stdtrit(freedom, 0.5 + 0.5 * level))


def student_interval(
    values: Real, standard_error: Real, degrees_of_freedom: ArrayLike, level: float
) -> tuple[Real, Real]:
    """Return lower and upper bounds of the intervals with probability ``level``, (n,) each.

    ``values`` and ``standard_error`` are (n,), ``degrees_of_freedom`` one number or (n,). Raises
    InputError for a level that is not between 0 and 1.
    """
    half = student_factor(level, degrees_of_freedom) * standard_error
    return values - half, values + half
