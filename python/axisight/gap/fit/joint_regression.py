"""Linear regression on many numbers of a model at once, from its normal equations.

Errors of a real machine last, so that neighbouring samples share them. Each axis is therefore weighed by what its own
best fit leaves. The scatter of a value is that of fits without one stretch of time each (delete-one-group jackknife).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import NormalEquations
from axisight.gap.fit.held_out import linear_step, predicted_loss
from axisight.statistics.intervals import student_factor
from axisight.statistics.tails import log_student_tail

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class JointRegression:
    """The step of all parameters to the minimum of their quadratic loss, within their bounds, and its scatter.

    - ``at``: where the step begins; ``layout``: axis and stretch of each block.
    - ``loose`` (p,): parameters of which nothing is known but their bounds: a uniform prior. Each needs two bounds.
    - ``step`` (p,): the step; ``deviation`` (p,): the standard deviation of a step without bounds.
    """

    def __init__(self, at: NormalEquations, layout: Layout, loose: Mask) -> None:
        width = [np.ptp(at.room[name]) for name, x in zip(at.parameters, loose, strict=True) if x]
        prior = at.prior_matrix.copy()
        # The variance of a uniform distribution is a twelfth of its squared width.
        prior[loose, loose] += 12.0 / np.square(width)
        self.at, self.layout = replace(at, prior_matrix=prior, jacobian=()), layout
        self._all = np.ones(len(at.parameters), dtype=bool)
        self._weight = self._weights()
        self.step = self._minimum(self._weight, self._all)
        # A step at its bound is no surer for that: the scatter is that of steps without bounds.
        without = self._without_each(self._all, bounded=False)
        self._freedom = len(without) - 1
        self.deviation = np.sqrt(self._freedom * without.var(axis=0))

    def interval(self, column: int, level: float) -> tuple[float, float]:
        """Return the interval of a step with a probability ``level`` [1]."""
        reach = float(student_factor(level, self._freedom)) * self.deviation[column]
        return float(self.step[column] - reach), float(self.step[column] + reach)

    def is_sure(self, column: int, false_alarms: float) -> bool:
        """Whether a step differs from zero, with a probability ``false_alarms`` [1] of an error."""
        size = abs(float(self.step[column]))
        if size == 0.0 or self._freedom < 1:
            return False
        t = size / max(float(self.deviation[column]), 1e-12 * size)
        return bool(log_student_tail(t, self._freedom) < np.log(false_alarms / 2))

    def rise(self, column: int, axis: int) -> float:
        """Return the rise of the loss of an axis (from 0) without one parameter, over what the regression leaves there.

        All other parameters are fitted again.
        """
        others = self._all.copy()
        others[column] = False
        here = self.layout.of(axis)
        with_it, without = (
            float(predicted_loss(self.at, here, x).sum())
            for x in (self.step, self._minimum(self._weight, others))
        )
        # Without noise, nothing is left but rounding.
        return without / max(with_it, 1e-300) - 1.0

    def weighed(self, loss: Array, axis: int | None) -> float:
        """Return a loss by block (n_blocks,), weighed by axis, on one axis (from 0) or on all."""
        return float((self._weight * loss)[self.layout.of(axis)].sum())

    def held_out(self, left_out: Mask | None = None) -> Array:
        """Return the loss of every block (n_blocks,), predicted without its stretch and without some parameters.

        ``left_out`` (p,): the parameters that do not move; by default none.
        """
        out = np.empty(len(self.at.loss))
        steps = self._without_each(self._all if left_out is None else ~left_out)
        for stretch, step in zip(np.unique(self.layout.stretch), steps, strict=True):
            inside = self.layout.stretch == stretch
            out[inside] = predicted_loss(self.at, inside, step)
        return out

    def _weights(self) -> Array:
        """Return the weight of every block (n_blocks,): one over the mean square that the axis' own fit leaves.

        Zero on axes that are not judged.
        """
        out = np.zeros(len(self.at.loss))
        for axis in np.setdiff1d(self.layout.axis, self.layout.silent):
            here = self.layout.of(int(axis))
            step = self._minimum(here.astype(np.float64), self._all)
            left = float(predicted_loss(self.at, here, step).sum())
            out[here] = float(self.layout.counted[here].sum()) / max(left, 1e-300)
        return out

    def _without_each(self, moving: Mask, *, bounded: bool = True) -> Array:
        """Return the steps without each stretch (n_stretches, p)."""
        stretch = self.layout.stretch
        each = (self._weight * (stretch != k) for k in np.unique(stretch))
        return np.array([self._minimum(weight, moving, bounded=bounded) for weight in each])

    def _minimum(self, weight: Array, moving: Mask, *, bounded: bool = True) -> Array:
        """Return the step (p,) of the ``moving`` parameters to the minimum; ``weight`` (n_blocks,)."""
        at, pick = self.at, np.ix_(moving, moving)
        one = NormalEquations(
            parameters=tuple(n for n, x in zip(at.parameters, moving, strict=True) if x),
            at_bound=at.at_bound,
            matrix=np.tensordot(weight, at.matrix, 1)[None][:, moving][:, :, moving],
            gradient=(weight @ at.gradient)[None, moving],
            loss=np.array([weight @ at.loss]),
            prior_matrix=at.prior_matrix[pick],
            prior_gradient=at.prior_gradient[moving],
            room=at.room if bounded else {},
        )
        step = np.zeros(len(at.parameters))
        step[moving] = linear_step(one)
        return step
