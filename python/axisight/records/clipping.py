"""Detect signals that a limit has clipped."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import Real, reals
from axisight.errors import InputError
from axisight.logs.quality import quantization

_LEAST_RUN = 3  # equal samples at the extreme
_LEAST_TIMES = 2  # times at the same extreme
_STEPS = 3.0  # quantization steps the slope must point beyond the extreme


def clipped_samples(signal: Real, meant: Real | None = None) -> int:
    """Return the number of samples of ``signal`` (n,) that a limit has clipped; 0 if there is no sign of it.

    A run of three or more samples at the largest or the smallest value counts if the step before it
    extrapolates beyond that value, by more than three quantization steps. Runs count if there are at least
    two at the same extreme. The flat top of a slow or coarsely quantized signal has no such slope before it,
    and a binary signal jumps from level to level. ``meant`` (n,), e.g. the reference, excuses runs in which
    it is flat itself. Soft saturation is not detected.

    Raises InputError for values that are not finite or not (n,), and for ``meant`` of another shape.
    """
    signal = reals("signal", signal, "numbers of shape (n,)", 1)
    if meant is not None:
        meant = reals("meant", meant, "numbers of shape (n,)", 1)
        if meant.shape != signal.shape:
            raise InputError(f"meant: expected shape {signal.shape} as signal, got {meant.shape}")
    threshold: float | None = None
    flat = None if meant is None else np.diff(meant, append=meant[-1]) == 0.0
    count = 0
    for side in (signal, -signal):
        top = float(side.max())
        starts, stops = _runs(side == top)
        flats = [
            (a, b) for a, b in zip(starts, stops, strict=True) if b - a >= _LEAST_RUN and a >= 2
        ]
        if len(flats) < _LEAST_TIMES:
            continue
        if threshold is None:  # only now: it is the slowest part, and few signals need it
            threshold = _threshold(signal)
        hit = [
            (a, b)
            for a, b in flats
            if 2 * side[a - 1] - side[a - 2] - top > threshold
            and not (flat is not None and flat[a : b - 1].all())
        ]
        if len(hit) >= _LEAST_TIMES:
            count += sum(b - a for a, b in hit)
    return count


def _threshold(signal: Real) -> float:
    """Return by how much a slope must extrapolate beyond an extreme to count."""
    found = quantization(np.asarray(signal))
    return _STEPS * found.step if found is not None else 1e-6 * float(np.ptp(signal))


def _runs(mask: NDArray[np.bool_]) -> tuple[list[int], list[int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return edges[::2].tolist(), edges[1::2].tolist()
