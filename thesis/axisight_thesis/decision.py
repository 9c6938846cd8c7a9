"""Decisions (yes, no or undecided) from the spread over realizations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from axisight.statistics.intervals import student_factor

PROBABILITY = 0.95


def positive(values: ArrayLike) -> bool | None:
    """Return whether the mean of independent values is above zero; None if undecided.

    The result is decided if zero lies outside the 95 % interval of the mean, by Student's t. A single
    value decides nothing; equal values do.
    """
    middle, half = _interval(values)
    if abs(middle) <= half:
        return None
    return middle > 0


def all_of(verdicts: Sequence[bool | None]) -> bool | None:
    """Return False if any verdict is False, else None if any is undecided, else True."""
    if any(v is False for v in verdicts):
        return False
    return None if any(v is None for v in verdicts) else True


def interval(values: ArrayLike, form: str = "+.2f") -> str:
    """Return mean and 95 % interval as text."""
    middle, half = _interval(values)
    return f"{middle:{form}} ± {half:{form.lstrip('+')}}"


def _interval(values: ArrayLike) -> tuple[float, float]:
    array = np.asarray(values, dtype=np.float64)
    count = len(array)
    if count < 2:
        return float(array.mean()), float("inf")
    width = float(student_factor(PROBABILITY, count - 1))
    return float(array.mean()), width * float(array.std(ddof=1)) / float(np.sqrt(count))
