"""Checks of arguments that all signals share."""

from __future__ import annotations

import numpy as np

from axisight.arguments import Real, positive, reals, shown
from axisight.errors import InputError

# Most samples of a signal over all periods: 1 GB. The core's own bound is higher.
MOST_SAMPLES = 2**27

# Squares of such sizes, and their sums, stay finite and above zero.
SMALLEST_SIZE, LARGEST_SIZE = 1e-100, 1e100


def whole_samples(field: str, seconds: object, sample_time_s: object) -> int:
    """Return ``seconds`` as a number of samples, which must be whole up to rounding."""
    step = positive("sample_time_s", sample_time_s)
    ratio = positive(field, seconds) / step
    count = round(ratio) if ratio < MOST_SAMPLES else 0
    if count < 1 or abs(ratio - count) > 1e-9 * count:
        raise InputError(
            f"{field}: expected a positive whole number of samples of {step} s, at most "
            f"{MOST_SAMPLES}, got {shown(seconds)} s"
        )
    return count


def few_enough(field: str, n_samples: int) -> int:
    """Return ``n_samples``; raises InputError above MOST_SAMPLES."""
    if n_samples > MOST_SAMPLES:
        raise InputError(f"{field}: expected at most {MOST_SAMPLES} samples, got {n_samples}")
    return n_samples


def numbers(field: str, value: object, count: int) -> Real:
    """Return a copy of ``count`` finite numbers."""
    if count == 0 and isinstance(value, list | tuple | np.ndarray) and not len(value):
        return np.empty(0)
    array = reals(field, value, f"{count} finite numbers", (0, 1))
    if array.shape != (count,):
        raise InputError(f"{field}: expected {count} finite numbers, got shape {array.shape}")
    return array.copy()


def per_item(field: str, value: object, count: int) -> Real:
    """Return one finite number per item from one number or ``count``."""
    array = reals(field, value, f"{count} finite numbers or one", (0, 1))
    return numbers(field, np.full(count, float(array)) if array.ndim == 0 else array, count)


def size_of(field: str, value: object) -> float:
    """Return a positive amplitude from SMALLEST_SIZE to LARGEST_SIZE; raises InputError for others."""
    size = positive(field, value)
    if not SMALLEST_SIZE <= size <= LARGEST_SIZE:
        raise InputError(
            f"{field}: expected {SMALLEST_SIZE:g} to {LARGEST_SIZE:g}, got {shown(value)}"
        )
    return size


def band_of(field: str, value: object) -> tuple[float, float]:
    """Return two positive frequencies."""
    ends = reals(field, value, "two frequencies (low, high)", 1)
    if ends.shape != (2,):
        raise InputError(f"{field}: expected two frequencies (low, high), got {shown(value)}")
    return positive(field, ends[0]), positive(field, ends[1])
