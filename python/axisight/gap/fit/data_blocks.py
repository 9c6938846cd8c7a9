"""Losses of data blocks summed by axis and by stretch of time, and how sure their fall is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.statistics.tails import log_student_tail

Array = NDArray[np.float64]

# Stretches of all logs together, where they are long enough: with fewer, a mean has to lie too
# many of its own standard errors from zero to be believed.
_STRETCHES = 16


@dataclass(frozen=True)
class Layout:
    """Where the blocks of a problem lie: ``axis`` from 0, ``stretch``, ``log``, each (n_blocks,).

    ``counted`` (n_blocks,): what the residuals of a block count for in all.

    A stretch is a piece of time of one log, all axes: what happens then on one axis and on
    another is not independent.
    """

    axis: NDArray[np.int64]
    stretch: NDArray[np.int64]
    log: NDArray[np.int64]
    counted: Array

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return int(self.axis.max()) + 1

    def of(self, axis: int | None) -> NDArray[np.bool_]:
        """Return which blocks (n_blocks,) are of an axis (from 0); all where that is None."""
        return np.ones(len(self.axis), dtype=bool) if axis is None else self.axis == axis

    def by_axis(self, values: Array) -> Array:
        """Return the sum (n_axes,) of values by block (n_blocks,)."""
        return np.asarray(np.bincount(self.axis, values, minlength=self.n_axes), np.float64)

    def samples(self) -> Array:
        """Return what the residuals of each axis count for (n_axes,): their number where all are one."""
        return self.by_axis(self.counted)

    def significance(self, before: Array, after: Array, axis: int | None = None) -> float:
        """Return how sure a fall of loss by block is, in standard deviations of a normal.

        The fall is summed over the axes (or one ``axis``, from 0) within each stretch of time and
        compared with its scatter between the stretches of a log: that one log shows an effect
        and another does not is no doubt of it. An effect may show in a few loud stretches only,
        or be drowned by one: the plain sums and those relative to the loss of their stretch are
        both tried, and the larger counts.
        """
        used = np.ones(len(before), bool) if axis is None else self.axis == axis
        _, first, stretches = np.unique(self.stretch[used], return_index=True, return_inverse=True)
        logs = self.log[used][first]
        old = np.asarray(np.bincount(stretches, before[used]), np.float64)
        new = np.asarray(np.bincount(stretches, after[used]), np.float64)
        fall = old - new
        relative = fall / np.maximum(old + new, 1e-300)
        return max(_standard_errors(fall, logs), _standard_errors(relative, logs))


def layout_of(fitted: FittedModel) -> Layout:
    """Return where the blocks of a fitted model lie.

    The stretches of a log count for as much each: one in which every axis stands would say nothing,
    and nothing is no scatter.
    """
    stretch = np.zeros(len(fitted.log), dtype=np.int64)
    logs = np.unique(fitted.log)
    wanted = max(4, -(-_STRETCHES // len(logs)))
    first = 0
    for log in logs:
        by_axis = []
        for axis in np.unique(fitted.axis[fitted.log == log]):
            rows = np.flatnonzero((fitted.log == log) & (fitted.axis == axis))
            by_axis.append(rows[np.argsort(fitted.start[rows], kind="stable")])
        # Blocks of all axes lie at the same times.
        counted = np.sum([fitted.samples[rows] for rows in by_axis], axis=0)
        numbers = _even_parts(counted, min(wanted, len(counted)))
        for rows in by_axis:
            stretch[rows] = first + numbers
        first += int(numbers.max()) + 1
    return Layout(fitted.axis, stretch, fitted.log, fitted.samples)


def _even_parts(counted: Array, count: int) -> NDArray[np.int64]:
    """Return which of ``count`` parts each block (n,) lies in, parts that count for as much."""
    total = np.cumsum(counted)
    middle = (total - 0.5 * counted) / max(float(total[-1]), 1e-300)
    return np.minimum((count * middle).astype(np.int64), count - 1)


def _standard_errors(x: Array, logs: NDArray[np.int64]) -> float:
    """Return the mean over its standard error, as the normal deviate of equal probability.

    The standard error of a stratified mean: scatter within each log, pooled.
    """
    # A simulation that diverges leaves what has no square.
    x = x / max(float(np.abs(x).max()), 1e-300)
    own = [x[logs == log] for log in np.unique(logs)]
    if max(len(part) for part in own) < 2:
        own = [x]
    freedom = sum(len(part) - 1 for part in own)
    if freedom < 1:
        return 0.0
    pooled = sum(float(((part - part.mean()) ** 2).sum()) for part in own) / freedom
    mean = float(x.mean())
    t = mean / max(float(np.sqrt(pooled / len(x))), 1e-12 * abs(mean), 1e-300)
    # The scatter is known from these few only; beyond what floating point holds, it is sure.
    tail = log_student_tail(t, freedom)
    return float(-scipy.special.ndtri_exp(tail)) if tail > -700 else 37.0
