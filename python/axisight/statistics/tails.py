"""Tails of the normal, Student's and Fisher's distributions.

They avoid ``scipy.stats``, which takes longer to load than these functions to evaluate.
"""

from __future__ import annotations

import numpy as np
import scipy


def normal_deviate(tail: float) -> float:
    """Return the standard deviations that a normal deviate exceeds with probability ``tail``."""
    return float(-scipy.special.ndtri(tail))


def log_student_tail(value: float, degrees_of_freedom: float) -> float:
    """Return the logarithm of the probability that a Student's t is larger than ``value``.

    Minus infinity for a probability too small for floating point.
    """
    with np.errstate(divide="ignore"):
        return float(np.log(scipy.special.stdtr(degrees_of_freedom, -value)))


def log_fisher_tail(value: float, above: float, below: float) -> float:
    """Return the logarithm of the probability that a ratio of variances is larger than ``value``.

    ``above`` and ``below`` are the degrees of freedom of numerator and denominator. Minus infinity for
    a probability too small for floating point.
    """
    with np.errstate(divide="ignore"):
        return float(np.log(scipy.special.fdtrc(above, below, value)))
