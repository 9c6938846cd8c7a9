"""Tails of the normal, Student's and Fisher's distributions.

As the package of all distributions has them, which takes longer to load than these to be evaluated.
"""

from __future__ import annotations

import numpy as np
import scipy


def normal_deviate(tail: float) -> float:
    """Return the standard deviations above which a normal deviate lies with probability ``tail``."""
    return float(-scipy.special.ndtri(tail))


def log_student_tail(value: float, degrees_of_freedom: float) -> float:
    """Return the logarithm of the probability that a Student's t is larger than ``value``.

    Minus infinity where floating point has no such probability.
    """
    with np.errstate(divide="ignore"):
        return float(np.log(scipy.special.stdtr(degrees_of_freedom, -value)))


def log_fisher_tail(value: float, above: float, below: float) -> float:
    """Return the logarithm of the probability that a ratio of variances is larger than ``value``.

    ``above``, ``below``: degrees of freedom of numerator and denominator. Minus infinity where floating
    point has no such probability.
    """
    with np.errstate(divide="ignore"):
        return float(np.log(scipy.special.fdtrc(above, below, value)))
