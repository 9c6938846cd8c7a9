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


def joint_covariance(
    models: Sequence[InnovationsModel], experiments: Sequence[Sequence[Experiment]]
) -> Real:
    """Return the covariance of the parameters of several models, one model after the other.

    ``experiments`` are those of each model, with the same samples. To first order the parameters move
    by a sum of errors times influences. Products of errors up to `LAGS` samples apart are added,
    tapered (Newey and West, 1987). As in `InnovationsModel.covariance`, nothing is said about changes
    of coordinates. NaN if the data do not determine a model.
    """
    total = sum(len(m.covariance) for m in models)
    each = [_influence(m, data) for m, data in zip(models, experiments, strict=True)]
    if any(part is None for part in each):
        return np.full((total, total), np.nan)
    parts = [part for part in each if part is not None]
    errors = [np.hstack([e[k] for _, e in parts]) for k in range(len(experiments[0]))]
    influences = [_beside([m[k] for m, _ in parts]) for k in range(len(experiments[0]))]
    n = sum(map(len, errors))
    out = np.zeros((total, total))
    for lag in range(LAGS + 1):
        late = [(e[: len(e) - lag], e[lag:]) for e in errors]
        power = sum((a.T @ b for a, b in late), np.zeros((errors[0].shape[1],) * 2)) / n
        taper = 1 - lag / (LAGS + 1)
        for m in influences:
            seen = (m[:, : m.shape[1] - lag] @ power).reshape(total, -1)
            part = taper * seen @ m[:, lag:].reshape(total, -1).T
            out += part if lag == 0 else part + part.T
    return out


def _influence(
    model: InnovationsModel, experiments: Sequence[Experiment]
) -> tuple[list[Real], list[Real]] | None:
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


def _beside(parts: list[Real]) -> Real:
    """Return influences of all parameters on all errors, (parameters, n, errors)."""
    rows, columns = (sum(m.shape[axis] for m in parts) for axis in (0, 2))
    out = np.zeros((rows, parts[0].shape[1], columns))
    row = column = 0
    for m in parts:
        out[row : row + m.shape[0], :, column : column + m.shape[2]] = m
        row, column = row + m.shape[0], column + m.shape[2]
    return out
