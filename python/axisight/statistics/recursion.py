"""Recursive filters: linear difference equations, states of linear models, and low-passes of Butterworth's kind.

The core solves the difference equations, since ``scipy.signal`` takes longer to load than all filters of a diagnosis
take to run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight import _core

Array = NDArray[np.float64]


def recursive(above: Sequence[float], below: Sequence[float], x: Array) -> Array:
    """Return ``y`` of the shape of ``x``, (n,) or (n, k), filtered along the first dimension.

    ``below[0] y[t] + below[1] y[t - 1] + ... = above[0] x[t] + above[1] x[t - 1] + ...``; ``x`` and ``y`` are zero
    before the first sample. Raises InputError if ``below[0]`` is zero.
    """
    signals = np.asarray(x, dtype=np.float64)
    return _core.recursive(above, below, signals.reshape(len(x), -1)).reshape(signals.shape)


def states(a: Array, drive: Array, start: Array) -> Array:
    """Return x(0) to x(n_samples) of ``x(t + 1) = A x(t) + v(t)``, (n_samples + 1, n_states, n_columns).

    ``a`` (n_states, n_states); ``drive``: v(t), (n_samples, n_states, n_columns), where every column is a separate
    motion; ``start``: x(0), (n_states, n_columns). A sample costs n_states^2 multiplications a column. Raises
    InputError for other shapes.
    """
    if not start.size:
        return np.zeros((len(drive) + 1, *start.shape))
    return np.asarray(_core.linear_states(*(np.asarray(x, np.float64) for x in (a, drive, start))))


def settled(above: Sequence[float], below: Sequence[float], x: Array) -> Array:
    """Return the same as `recursive` for a filter of gain one at zero frequency, settled at the first sample."""
    return np.asarray(recursive(above, below, x - x[0]) + x[0], dtype=np.float64)


def butterworth(order: int, cutoff: float) -> list[tuple[list[float], list[float]]]:
    """Return the sections (above, below) of a low-pass, each of the second order, or of the first if one is left.

    ``cutoff``: frequency of half the power, as a share of the Nyquist frequency, between 0 and 1. The bilinear
    transform makes the filter discrete, exact at this frequency.
    """
    w = float(np.tan(0.5 * np.pi * cutoff))
    sections = []
    for k in range(order // 2):
        # Twice the damping of a pair of poles; they lie evenly on the left half of a circle.
        damped = 2.0 * float(np.sin((2 * k + 1) * np.pi / (2 * order)))
        below = [1.0 + damped * w + w * w, 2.0 * (w * w - 1.0), 1.0 - damped * w + w * w]
        sections.append(([w * w, 2.0 * w * w, w * w], below))
    if order % 2:
        sections.append(([w, w], [1.0 + w, w - 1.0]))
    return sections


def zero_phase(order: int, cutoff: float, x: Array) -> Array:
    """Return a signal (n,) or (n, k) after a Butterworth low-pass forward and backward, settled at both ends."""
    for _ in range(2):
        for above, below in butterworth(order, cutoff):
            x = settled(above, below, x)
        x = x[::-1]
    return x
