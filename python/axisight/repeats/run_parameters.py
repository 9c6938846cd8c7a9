"""Parameters of every run by regression, with the variance that noise within a run gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.repeats.columns import Columns
from axisight.statistics.cluster_scatter import ClusterScatter

Array = NDArray[np.float64]

# Blocks of consecutive samples whose scatter gives the variance within a run.
_BLOCKS = 20


@dataclass(frozen=True, eq=False)
class RunParameters:
    """Parameters of every run.

    columns
        Names, units, axes and levels.
    values
        (n_runs, n_parameters).
    variance
        (n_runs, n_parameters), from noise within the run; NaN where few blocks decide a parameter.
    """

    columns: Columns
    values: Array
    variance: Array


def run_parameters(columns: Columns, weight: Array) -> RunParameters:
    """Return the parameters of every run, with samples weighted by ``weight`` (n_samples, n_axes).

    What no parameter explains in all runs alike is no noise: the variance comes from the residuals less
    their mean over runs. Axes are weighted by one over the rms deviation of a run from the mean run.

    Raises InputError if fewer samples than parameters are left.
    """
    n_runs, n, n_axes, k = columns.matrix.shape
    if np.count_nonzero(weight) <= k:
        raise InputError(
            f"logs: expected more than {k} samples outside reversals, got {np.count_nonzero(weight)}; "
            "take longer logs or a higher cutoff"
        )
    apart = columns.torque - columns.torque.mean(axis=0)
    size = np.sqrt(np.mean(apart**2 * weight, axis=(0, 1)))
    scaled = weight / np.where(size > 0, size, 1.0)
    matrix = (scaled[..., None] * columns.matrix).reshape(n_runs, n * n_axes, k)
    torque = (scaled * columns.torque).reshape(n_runs, n * n_axes)
    roots, found = [], np.empty((n_runs, k))
    for run in range(n_runs):
        q, r = np.linalg.qr(matrix[run])
        found[run] = np.linalg.solve(r, q.T @ torque[run])
        roots.append(np.linalg.inv(r))
    residual = torque - np.einsum("rnk,rk->rn", matrix, found)
    # The mean over runs takes its share of the noise away.
    residual = (residual - residual.mean(axis=0)) * np.sqrt(n_runs / (n_runs - 1))
    variance = np.array(
        [
            _variance(root, m @ root, e, n, n_axes)
            for root, m, e in zip(roots, matrix, residual, strict=True)
        ]
    )
    return RunParameters(columns, columns.level + found, variance)


def _variance(root: Array, lever: Array, residual: Array, n: int, n_axes: int) -> Array:
    """Return the variance (n_parameters,) from the scatter of blocks of consecutive samples."""
    count = min(_BLOCKS, n)
    length = -(-n // count) * n_axes
    missing = count * length - len(residual)
    scatter = ClusterScatter(
        root=root,
        lever=np.pad(lever, ((0, missing), (0, 0))).reshape(count, length, -1),
        residual=np.pad(residual, (0, missing)).reshape(count, length),
    )
    return np.asarray(np.diag(scatter.covariance), dtype=np.float64)
