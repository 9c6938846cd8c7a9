"""Linear regression from triangular factors, one per block of samples and row.

All functions work on the factors of ``[Phi | tau]`` (:func:`axisight._core.regression_factors`), so
that their cost does not depend on the number of samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from axisight.statistics.cluster_scatter import ClusterScatter

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Factors:
    """Triangular factors of a regression.

    blocks
        Shape (n_blocks, n_rows, k + 1, k + 1); the last column is the torque.
    counts
        Number of samples of each row, shape (n_rows,).
    """

    blocks: Array
    counts: Array

    @property
    def k(self) -> int:
        """Number of parameters."""
        return int(self.blocks.shape[-1]) - 1

    @cached_property
    def rows(self) -> Array:
        """One factor per row, shape (n_rows, k + 1, k + 1)."""
        stacked = self.blocks.swapaxes(0, 1).reshape(self.blocks.shape[1], -1, self.k + 1)
        return triangle(stacked)

    def columns(self, keep: NDArray[np.intp] | list[int]) -> Factors:
        """Return the factors of some of the parameters."""
        keep = np.asarray(keep, dtype=np.intp)
        return Factors(self.blocks[..., np.append(keep, self.k)], self.counts)

    def combined(self, basis: Array) -> Factors:
        """Return the factors for new parameters p, old ones being ``basis @ p``."""
        k = self.k
        blocks = np.concatenate([self.blocks[..., :k] @ basis, self.blocks[..., k:]], axis=-1)
        return Factors(blocks, self.counts)


@dataclass(frozen=True, eq=False)
class Solution:
    """The solution of a regression.

    values
        Parameters, shape (k,).
    weight
        Weight of each row, shape (n_rows,).
    normal
        Upper triangular factor of the matrix whose inverse gives the white covariance.
    sigma
        Standard deviation of the residual of each row [Nm].
    loss
        Sum of squared residuals of each row [Nm^2].
    iterations, converged
        Iterations of the row weights, and whether they converged.
    noise
        Standard deviation of the error of each column relative to that of the torque, for total least
        squares; else zero.
    """

    values: Array
    weight: Array
    normal: Array
    sigma: Array
    loss: Array
    iterations: int
    converged: bool
    noise: Array


def triangle(stack: Array) -> Array:
    """Return the square triangular factor, filled with zero rows if needed."""
    n = stack.shape[-1]
    out: Array = np.asarray(np.linalg.qr(stack, mode="r"), dtype=np.float64)
    missing = n - out.shape[-2]
    if missing <= 0:
        return out
    padding = np.zeros((*out.shape[:-2], missing, n))
    return np.concatenate([out, padding], axis=-2)


def solve_weighted(factors: Factors, weight: Array) -> Solution:
    """Return the least-squares solution with a weight per row, (4.5)."""
    k, rows = factors.k, factors.rows
    r = triangle((weight[:, None, None] * rows).reshape(-1, k + 1))
    values = _back(r[:k, :k], r[:k, k])
    residual = rows[..., :k] @ values - rows[..., k]
    loss = (residual**2).sum(axis=-1)
    # The degrees of freedom of each row that the fit uses.
    hat = weight[:, None, None] * _right_divide(rows[..., :k], r[:k, :k])
    free = np.maximum(factors.counts - (hat**2).sum(axis=(1, 2)), 1.0)
    return Solution(
        values=values,
        weight=weight,
        normal=r[:k, :k],
        sigma=np.sqrt(loss / free),
        loss=loss,
        iterations=1,
        converged=True,
        noise=np.zeros(k),
    )


def solve_reweighted(factors: Factors, floor: Array, iterations: int = 50) -> Solution:
    """Return the solution with each row weighted by its own residual, iterated until weights settle.

    ``floor`` [Nm] limits the weight of a row with residuals at rounding level.
    """
    solution = solve_weighted(factors, np.ones(len(factors.counts)))
    for iteration in range(2, iterations + 1):
        before = np.maximum(solution.sigma, floor)
        solution = solve_weighted(factors, 1.0 / before)
        after = np.maximum(solution.sigma, floor)
        if np.abs(after / before - 1.0).max() < 1e-8:
            return _counted(solution, iteration, True)
    return _counted(solution, iterations, False)


def _counted(solution: Solution, iterations: int, converged: bool) -> Solution:
    changes = {"iterations": iterations, "converged": converged}
    return Solution(**{**solution.__dict__, **changes})


def solve_total(factors: Factors, start: Solution, noise: Array) -> Solution | None:
    """Return the total least-squares solution, for errors in the regressor too, or None without one.

    Golub and Van Loan (1980). ``noise`` holds the standard deviation of each column's error relative
    to that of the torque, zero for columns without error (mixed problem, Van Huffel and Vandewalle
    1991). Row weights are those of ``start``.
    """
    k, rows, weight = factors.k, factors.rows, start.weight
    noisy = noise > 0
    order = np.concatenate([np.flatnonzero(~noisy), np.flatnonzero(noisy)])
    scale = np.where(noisy, noise, 1.0)[order]
    stack = (weight[:, None, None] * rows).reshape(-1, k + 1)
    r = triangle(np.column_stack([stack[:, order] / scale, stack[:, k]]))
    exact = int((~noisy).sum())
    direction = np.linalg.svd(r[exact:, exact:])[2][-1]
    if abs(direction[-1]) < 1e-8:
        return None
    scaled = np.empty(k)
    scaled[exact:] = -direction[:-1] / direction[-1]
    right = r[:exact, k] - r[:exact, exact:k] @ scaled[exact:]
    scaled[:exact] = _back(r[:exact, :exact], right)
    values = np.empty(k)
    values[order] = scaled / scale
    residual = rows[..., :k] @ values - rows[..., k]
    loss = (residual**2).sum(axis=-1)
    spread = 1.0 + noise**2 @ values**2
    floor = (weight**2 @ loss) / spread
    a = stack[:, :k]
    normal = np.linalg.cholesky(a.T @ a - floor * np.diag(noise**2), upper=True)
    return Solution(
        values=values,
        weight=weight,
        normal=np.asarray(normal),
        sigma=np.sqrt(loss / factors.counts),
        loss=loss,
        iterations=start.iterations,
        converged=start.converged,
        noise=noise,
    )


def white_covariance(factors: Factors, solution: Solution) -> Array:
    """Return the covariance for white residuals, with a separate variance for each row."""
    k = factors.k
    scaled = (solution.weight**2 * solution.sigma)[:, None, None] * factors.rows[..., :k]
    root = _right_divide(scaled.reshape(-1, k), solution.normal)
    inverse = _back(solution.normal, np.eye(k))
    half = root @ inverse.T
    return np.asarray(half.T @ half, dtype=np.float64)


def block_covariance(factors: Factors, solution: Solution) -> tuple[Array, Array]:
    """Return the covariance from the scatter of the blocks, and degrees of freedom per parameter.

    It allows for residuals that are correlated within blocks and between rows, see
    :class:`axisight.statistics.cluster_scatter.ClusterScatter`. If there are as many equations as
    parameters, or one block alone decides a parameter, its scatter is unknown: the covariance is NaN
    and the degrees of freedom are zero.
    """
    k, weight = factors.k, solution.weight
    n_blocks = len(factors.blocks)
    stacked = (weight[:, None, None] * factors.blocks).reshape(n_blocks, -1, k + 1)
    r = triangle(stacked)
    residual = r[..., :k] @ solution.values - r[..., k]
    scatter = ClusterScatter(
        root=_back(solution.normal, np.eye(k)),
        lever=_right_divide(r[..., :k], solution.normal),
        residual=residual,
        score=-_error_in_columns(solution, residual) if solution.noise.any() else 0.0,
    )
    return scatter.covariance, scatter.degrees_of_freedom


def _error_in_columns(solution: Solution, residual: Array) -> Array:
    """Return the contribution of errors in the columns to the scores of total least squares."""
    spread = 1.0 + solution.noise**2 @ solution.values**2
    loss = (residual**2).sum(axis=1)
    pull = solution.noise**2 * solution.values / spread
    return np.outer(loss, np.linalg.solve(solution.normal.T, pull))


def _back(r: Array, right: Array) -> Array:
    """Return ``r^-1 right`` for an upper triangular r."""
    if len(r) == 0:
        return np.zeros_like(right)
    return np.asarray(scipy.linalg.solve_triangular(r, right), dtype=np.float64)


def _right_divide(a: Array, r: Array) -> Array:
    """Return ``a r^-1`` for an upper triangular r."""
    flat = a.reshape(-1, a.shape[-1])
    out = scipy.linalg.solve_triangular(r, flat.T, trans="T").T
    return np.asarray(out.reshape(a.shape), dtype=np.float64)
