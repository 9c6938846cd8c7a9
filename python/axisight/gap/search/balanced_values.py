"""Values of causes and own parameters where the model leaves more than noise.

A real machine differs from any rigid model by many times its noise, with errors that last. Counted as independent
noise, they outvote the tolerances: masses and friction go to the edge of their tolerance, and bias the cause. Here the
errors of each axis are weighed by what they tell (composite likelihood).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.rank_deficiency import pseudo_inverse
from axisight.gap.search.state import SearchState
from axisight.statistics.intervals import NORMAL_DEVIATIONS, student_factor

Array = NDArray[np.float64]

# Least number of blocks of an axis to estimate the scatter of its errors.
_BLOCKS = 8


def with_balanced_values(found: SearchState, fitter: ModelFitter) -> SearchState:
    """Return the search with values fitted again, with data and tolerances weighed by the errors that are left.

    Causes and what they explain stay. By inverse dynamics only: in closed loop, a model that leaves more than noise has
    no causes.
    """
    if not fitter.adds_up:
        return found
    baseline, model = (_balanced(m, fitter) for m in (found.baseline, found.model))
    return replace(found, baseline=baseline, model=model)


def _balanced(model: FittedModel, fitter: ModelFitter) -> FittedModel:
    excess = inflation(model)
    if not (excess > 1).any():
        return model
    fitted = fitter.tempered(1 / np.sqrt(excess)).fit(model.free, model, fresh=True)
    if isinstance(fitted, Diverged) or not (fitted.converged or fitted.stuck):
        return model
    return replace(
        model,
        effects=fitted.effects,
        free=fitted.free,
        robot_values=fitted.robot_values,
        std=deviations(fitted),
        balanced=fitted.at_bound,
    )


def inflation(model: FittedModel) -> Array:
    """Return by how much the gradient of every axis scatters more than its weights say (n_axes,), at least one.

    tr(H^-1 J) / tr(H^-1 A), with A the normal equations of the axis, H these plus the tolerances, and J the
    scatter of the gradient between blocks. It is one if errors are independent and as large as the weights say.
    This is the magnitude adjustment of composite likelihoods (Pauli, Racugno and Ventura 2011, Statistica Sinica
    21(1)).
    """
    out = np.ones(int(model.axis.max()) + 1)
    if not model.parameters:
        return out
    for axis in range(len(out)):
        mine = (model.axis == axis) & (model.loss > 0)
        if mine.sum() < _BLOCKS:
            continue
        curvature = model.matrix[mine].sum(axis=0)
        gradient = model.gradient[mine] - model.gradient[mine].mean(axis=0)
        scatter = gradient.T @ gradient
        inverse = pseudo_inverse(curvature + model.prior_matrix)
        told = float(np.sum(inverse * curvature))
        if told > 0:
            out[axis] = max(1.0, float(np.sum(inverse * scatter)) / told)
    return out


def deviations(model: FittedModel) -> dict[tuple[int | None, str], float]:
    """Return the standard deviation of every parameter, by a jackknife over stretches of time, all axes together.

    The variance of the tolerances is added. The result is scaled by the ratio of Student's to the normal quantile, so
    that intervals can be made as for a normal distribution.
    """
    stretch = stretches(model)
    count = int(stretch.max()) + 1
    if count < _BLOCKS:
        return dict(model.std)
    used = [i for i, name in enumerate(model.parameters) if name not in model.at_bound]
    pick = np.ix_(used, used)
    matrix = np.zeros((count, len(used), len(used)))
    gradient = np.zeros((count, len(used)))
    np.add.at(matrix, stretch, model.matrix[:, used][:, :, used])
    np.add.at(gradient, stretch, model.gradient[:, used])
    prior = model.prior_matrix[pick]
    whole, pull = matrix.sum(axis=0) + prior, gradient.sum(axis=0) + model.prior_gradient[used]
    without = np.stack(
        [pseudo_inverse(whole - m) @ (pull - g) for m, g in zip(matrix, gradient, strict=True)]
    )
    scatter = (count - 1) * without.var(axis=0)
    inverse = pseudo_inverse(whole)
    known = np.diag(inverse @ prior @ inverse)
    # Intervals are made as of a normal distribution.
    quantile = float(student_factor(0.95, count - 1)) / NORMAL_DEVIATIONS
    found = quantile * np.sqrt(scatter + known)
    return {
        **model.std,
        **{model.parameters[i]: float(x) for i, x in zip(used, found, strict=True)},
    }


def stretches(model: FittedModel) -> NDArray[np.int64]:
    """Return the number of the stretch of time of every block (n_blocks,), the same on all axes."""
    place = np.zeros(len(model.axis), dtype=np.int64)
    for log in np.unique(model.log):
        for axis in np.unique(model.axis):
            mine = np.flatnonzero((model.log == log) & (model.axis == axis))
            place[mine[np.argsort(model.start[mine])]] = np.arange(len(mine))
    _, out = np.unique(np.stack([model.log, place]), axis=1, return_inverse=True)
    return np.asarray(out, dtype=np.int64).reshape(-1)
