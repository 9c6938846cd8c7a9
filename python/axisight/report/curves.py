"""Short SVG paths for long curves: few points, small integers, every peak kept."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def thin(time_s: Floats, values: Floats, points: int) -> tuple[Floats, Floats]:
    """Return about ``points`` samples of a curve: minimum and maximum of each stretch, so no peak is lost.

    ``time_s`` and ``values`` have shape (n,). Both results have the same shape (m,) in time order, with m <=
    points if n is larger. A stretch without finite values keeps one NaN as a gap.
    """
    n = values.size
    if n <= points:
        return time_s, values
    edges = np.linspace(0, n, points // 2 + 1).astype(int)
    keep: list[int] = []
    for start, stop in pairwise(edges):
        part = values[start:stop]
        finite = np.isfinite(part)
        if not finite.any():
            keep.append(int(start))
            continue
        low = start + int(np.argmin(np.where(finite, part, np.inf)))
        high = start + int(np.argmax(np.where(finite, part, -np.inf)))
        keep.extend(sorted({low, high}))
    return time_s[keep], values[keep]


def path(x: Floats, y: Floats) -> str:
    """Return the SVG path through points rounded to integers, interrupted at non-finite ones.

    ``x`` and ``y`` have shape (n,), in drawing coordinates.
    """
    known = np.isfinite(x) & np.isfinite(y)
    starts = np.flatnonzero(known & ~np.r_[False, known[:-1]])
    stops = np.flatnonzero(known & ~np.r_[known[1:], False]) + 1
    return "".join(_piece(x[a:b], y[a:b]) for a, b in zip(starts, stops, strict=True))


def _piece(x: Floats, y: Floats) -> str:
    points = np.rint(np.column_stack([x, y])).astype(int)
    steps = np.diff(points, axis=0)
    # A single point becomes a line of zero length, which round line ends make visible.
    moves = steps[np.any(steps != 0, axis=1)] if np.any(steps) else np.zeros((1, 2), dtype=int)
    line = " ".join(f"{dx}{'' if dy < 0 else ' '}{dy}" for dx, dy in moves.tolist())
    return f"M{points[0, 0]} {points[0, 1]}l{line}"
