"""Checks shared by the makers of signals."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError

Real = NDArray[np.float64]
Lines = NDArray[np.int64]

# More samples than memory holds anyway; the core's own bound.
_MOST = 1e9


def positive(field: str, value: float) -> float:
    """Return a positive finite number."""
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{field}: expected a positive number, got {value}")
    return float(value)


def whole(field: str, value: float, least: int = 1) -> int:
    """Return a whole number of at least ``least``."""
    if not (np.isfinite(value) and value == int(value) and value >= least):
        raise InputError(f"{field}: expected a whole number from {least}, got {value}")
    return int(value)


def whole_samples(field: str, seconds: float, sample_time_s: float) -> int:
    """Return ``seconds`` in samples; decimal fractions may be a rounding error off."""
    positive("sample_time_s", sample_time_s)
    ratio = positive(field, seconds) / sample_time_s
    count = round(ratio) if ratio < _MOST else 0
    if count < 1 or abs(ratio - count) > 1e-9 * count:
        raise InputError(
            f"{field}: expected a positive whole number of samples of {sample_time_s} s, "
            f"got {seconds} s"
        )
    return count


def seed_of(field: str, seed: int) -> int:
    """Return a seed or the number of a run."""
    if not 0 <= seed < 1 << 64:
        raise InputError(f"{field}: expected 0 to 2^64 - 1, got {seed}")
    return int(seed)


def numbers(field: str, value: ArrayLike, count: int) -> Real:
    """Return ``count`` finite numbers."""
    array = np.array(value, dtype=np.float64)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise InputError(f"{field}: expected {count} finite numbers, got shape {array.shape}")
    return array


def per_item(field: str, value: ArrayLike, count: int) -> Real:
    """Return one finite number per item from one number or ``count``."""
    array = np.asarray(value, dtype=np.float64)
    return numbers(field, np.full(count, float(array)) if array.ndim == 0 else array, count)


def lines_below(field: str, value: ArrayLike, n_samples: int) -> Lines:
    """Return ascending lines from 1 to below the Nyquist line of ``n_samples``."""
    array = np.asarray(value)
    if not array.size:
        return np.empty(0, np.int64)
    if array.ndim != 1 or not np.array_equal(array, np.round(array)):
        raise InputError(f"{field}: expected a list of whole numbers")
    lines = array.astype(np.int64)
    outside = lines[(lines < 1) | (2 * lines >= n_samples)]
    if outside.size:
        raise InputError(
            f"{field}: expected lines from 1 to below {n_samples / 2:g} (Nyquist), got {outside[0]}"
        )
    if np.any(np.diff(lines) <= 0):
        raise InputError(f"{field}: expected ascending lines without repetition")
    return lines
