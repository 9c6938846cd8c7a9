"""Covariance of several models that were fitted to the same samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.blackbox._data import Real
from axisight.blackbox.prediction_error.state_space import (
    InnovationsModel,
    matrices_of,
    problem_of,
)
from axisight.records.experiment import Experiment
from axisight.statistics.least_squares import inverse_root

LAGS = 20
"""Largest distance in samples at which errors of different models count as correlated."""

_Part = tuple[list[Real], list[Real]]
"""Influences (parameters, n, p) and errors (n, p) of one model, by experiment."""


def joint_covariance(
    models: Sequence[InnovationsModel], experiments: Sequence[Sequence[Experiment]]
) -> Real:
    """Return the covariance of the parameters of several models, one model after the other.

    ``experiments`` are those of each model, with the same samples. To first order the parameters move
    by a sum of errors times influences. Products of errors up to `LAGS` samples apart are added,
    tapered (Newey and West, 1987). As in `InnovationsModel.covariance`, nothing is said about changes
    of coordinates. NaN if the data do not determine a model.
    """
    each = [_influence(m, data) for m, data in zip(models, experiments, strict=True)]
    if any(part is None for part in each):
        total = sum(len(m.covariance) for m in models)
        return np.full((total, total), np.nan)
    parts = [part for part in each if part is not None]
    upper = {
        (i, j): _between(one, other)
        for i, one in enumerate(parts)
        for j, other in enumerate(parts)
        if i <= j
    }
    places = range(len(parts))
    out = np.block([[upper[i, j] if i <= j else upper[j, i].T for j in places] for i in places])
    return np.asarray((out + out.T) / 2)


def _between(one: _Part, other: _Part) -> Real:
    """Return the covariance of the parameters of two models."""
    n = sum(map(len, one[1]))
    out = np.zeros((len(one[0][0]), len(other[0][0])))
    for lag in range(-LAGS, LAGS + 1):
        # Errors of the first model at t, of the second at t + lag.
        early, late = (slice(max(-lag, 0), -lag if lag > 0 else None) for lag in (lag, -lag))
        pairs = zip(one[1], other[1], strict=True)
        size = (one[1][0].shape[1], other[1][0].shape[1])
        power = sum((a[early].T @ b[late] for a, b in pairs), np.zeros(size)) / n
        taper = 1 - abs(lag) / (LAGS + 1)
        for m, k in zip(one[0], other[0], strict=True):
            seen = (m[:, early] @ power).reshape(len(m), -1)
            out += taper * seen @ k[:, late].reshape(len(k), -1).T
    return out


def _influence(model: InnovationsModel, experiments: Sequence[Experiment]) -> _Part | None:
    """Return influences (parameters, n, p) and errors (n, p) by experiment."""
    problem, x = problem_of(model, experiments), matrices_of(model)
    ways = problem.layout.directions(x)
    slope = problem.jacobian(problem.layout.vector(x)) @ ways
    root = inverse_root(slope, len(slope) * np.finfo(float).eps)
    if root is None:
        return None
    p = problem.layout.p
    found = (-ways @ root @ root.T @ slope.T).reshape(len(ways), -1, p) @ problem.weight
    ends = np.cumsum([e.n_samples for e in experiments])[:-1]
    return np.split(found, ends, axis=1), problem.errors(x)
