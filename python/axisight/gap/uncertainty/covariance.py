"""Covariance of all parameters: standard errors of the verdict, correlations of the normal equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.rank_deficiency import pseudo_inverse
from axisight.gap.search.balanced_values import stretches

Array = NDArray[np.float64]


def covariance(at: FittedModel, std: Array) -> Array:
    """Return the covariance (p, p) of a model with normal equations ``at`` its values and standard errors ``std`` (p,).

    The standard errors are those of the verdict, from the scatter of data blocks. Correlations are a mean of two: those
    of the sandwich estimate with the same scatter, which allows for noise of any colour, and those of the inverse
    normal equations. With few blocks the scatter of p parameters is hardly known, and the second counts for more: its
    weight is p / (p + n) with n blocks. The mean is positive semidefinite. An infinite standard error stays infinite:
    nothing determines that parameter, and it correlates with none.
    """
    count = len(np.unique(stretches(at)))
    p = len(at.parameters)
    share = p / max(p + count, 1)
    mixed = (1 - share) * _correlation(sandwich(at)) + share * _correlation(inverse(at))
    known = np.isfinite(std)
    out = np.diag(np.where(known, 0.0, np.inf))
    size = np.where(known, std, 0.0)
    np.fill_diagonal(mixed, 1.0)
    finite = np.ix_(known, known)
    out[finite] = (mixed * np.outer(size, size))[finite]
    return np.asarray(out)


def inverse(at: FittedModel) -> Array:
    """Return the inverse normal equations (p, p), tolerances included."""
    return pseudo_inverse(at.matrix.sum(axis=0) + at.prior_matrix)


def sandwich(at: FittedModel) -> Array:
    """Return the sandwich estimate (p, p) with the scatter of the gradient between stretches of time."""
    known = inverse(at)
    gradient = by_stretch(at, at.gradient)
    return np.asarray(known @ (gradient.T @ gradient + at.prior_matrix) @ known)


def by_stretch(at: FittedModel, values: Array) -> Array:
    """Return the sums of values by block (n_blocks, ...) over all axes in each stretch of time, (n_stretches, ...)."""
    number = stretches(at)
    out = np.zeros((int(number.max()) + 1, *values.shape[1:]))
    np.add.at(out, number, values)
    return out


def _correlation(matrix: Array) -> Array:
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.where(size > 0, size, 1.0)
    return np.asarray(matrix / np.outer(scale, scale))


def bootstrap_std(at: FittedModel, *, draws: int, seed: int) -> Array:
    """Return standard deviations (p,) from a block bootstrap with one Gauss-Newton step for each draw.

    Stretches of time are drawn with replacement within each log, all axes together (Künsch 1989, Annals of Statistics
    17(3)). Tolerances are resampled too: each draw shifts the nominal values of own parameters by their tolerances.
    """
    number = stretches(at)
    first = np.unique(number, return_index=True)[1]
    log = at.log[first]
    matrix, gradient = by_stretch(at, at.matrix), by_stretch(at, at.gradient)
    precision = np.diag(at.prior_matrix)
    out = np.empty((draws, len(at.parameters)))
    for run in range(draws):
        rng = np.random.default_rng([seed, 0x626F6F74, run])
        picked = np.concatenate(
            [rng.choice(np.flatnonzero(log == k), (log == k).sum()) for k in np.unique(log)]
        )
        shift = np.sqrt(precision) * rng.standard_normal(len(precision))
        whole = matrix[picked].sum(axis=0) + at.prior_matrix
        pull = gradient[picked].sum(axis=0) - gradient.sum(axis=0) + shift
        out[run] = -pseudo_inverse(whole) @ pull
    return np.asarray(out.std(axis=0, ddof=1))
