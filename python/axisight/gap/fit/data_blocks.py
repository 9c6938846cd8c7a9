"""Sums the losses of data blocks by axis and by stretch of time, and tests how sure a fall of the loss is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.statistics.tails import log_student_tail

Array = NDArray[np.float64]

# Stretches of all logs together, if the logs are long enough. With fewer, a mean must be too many standard errors from
# zero to be significant.
_STRETCHES = 16


@dataclass(frozen=True)
class Layout:
    """Axis, stretch and log of each data block of a problem.

    ``axis`` (from 0), ``stretch``, ``log``: (n_blocks,) each. ``counted`` (n_blocks,): total weight of the residuals of
    a block, their number if no sample has less weight. ``silent``: axes that are not judged.

    A stretch is a piece of time of one log with all axes, because events on two axes at one time are not independent.
    """

    axis: NDArray[np.int64]
    stretch: NDArray[np.int64]
    log: NDArray[np.int64]
    counted: Array
    silent: tuple[int, ...] = ()

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return int(self.axis.max()) + 1

    def of(self, axis: int | None) -> NDArray[np.bool_]:
        """Return which blocks (n_blocks,) belong to an axis (from 0); all if it is None."""
        return np.ones(len(self.axis), dtype=bool) if axis is None else self.axis == axis

    def by_axis(self, values: Array) -> Array:
        """Return the sum (n_axes,) of values by block (n_blocks,)."""
        return np.asarray(np.bincount(self.axis, values, minlength=self.n_axes), np.float64)

    def samples(self) -> Array:
        """Return the total weight of the residuals of each axis (n_axes,): their number if all weights are one."""
        return self.by_axis(self.counted)

    def significance(self, before: Array, after: Array, axis: int | None = None) -> float:
        """Return how sure a fall of loss by block (n_blocks,) is, in standard deviations of a normal.

        The fall is summed over the axes, or one ``axis`` (from 0), in each stretch of time. It is compared with its
        scatter between the stretches of one log: an effect that shows in one log only is no less sure for that.

        An effect may show in a few loud stretches only, or one loud stretch may hide it. So the test is made with
        absolute falls and with falls relative to the loss of each stretch, and the larger value counts.
        """
        used = np.ones(len(before), bool) if axis is None else self.axis == axis
        _, first, stretches = np.unique(self.stretch[used], return_index=True, return_inverse=True)
        logs = self.log[used][first]
        old = np.asarray(np.bincount(stretches, before[used]), np.float64)
        new = np.asarray(np.bincount(stretches, after[used]), np.float64)
        fall = old - new
        relative = fall / np.maximum(old + new, 1e-300)
        return max(_standard_errors(fall, logs), _standard_errors(relative, logs))


def layout_of(fitted: FittedModel, silent: tuple[int, ...] = ()) -> Layout:
    """Return axis, stretch and log of the blocks of a fitted model; ``silent`` as in `Layout`.

    The stretches of a log have equal weight. A stretch in which every axis stands still would add a fall of zero and
    understate the scatter.
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
        # The blocks of all axes lie at the same times.
        counted = np.sum([fitted.samples[rows] for rows in by_axis], axis=0)
        numbers = _even_parts(counted, min(wanted, len(counted)))
        for rows in by_axis:
            stretch[rows] = first + numbers
        first += int(numbers.max()) + 1
    return Layout(fitted.axis, stretch, fitted.log, fitted.samples, silent)


def _even_parts(counted: Array, count: int) -> NDArray[np.int64]:
    """Return which of ``count`` parts of about equal weight each block (n,) lies in."""
    total = np.cumsum(counted)
    middle = (total - 0.5 * counted) / max(float(total[-1]), 1e-300)
    return np.minimum((count * middle).astype(np.int64), count - 1)


def _standard_errors(x: Array, logs: NDArray[np.int64]) -> float:
    """Return the mean over its standard error, as the normal deviate of equal probability.

    The standard error is that of a stratified mean, from the pooled scatter within each log.
    """
    # A diverging simulation leaves values whose square overflows.
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
    # Student's distribution, since few stretches give the scatter. Values above 37 exceed floating point.
    tail = log_student_tail(t, freedom)
    return float(-scipy.special.ndtri_exp(tail)) if tail > -700 else 37.0
