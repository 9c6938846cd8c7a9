"""Penalised least squares of one axis: coefficients, held-out predictions, and protected columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Labels = NDArray[np.int64]

SMOOTHINGS = tuple(10.0**k for k in range(-3, 4))
"""Weights of the penalty that are tried, relative to the data's."""
# Smallest torque of a direction of coefficients, as a share of the largest, that counts.
_NULL = 1e-7


@dataclass(frozen=True, eq=False)
class Block:
    """The columns (n, m) of a term in free coefficients, its penalty (m, m), and ``free`` (m_all, m).

    ``free`` gives all coefficients of the term from the free ones: those that take nothing from what is protected.
    """

    columns: Array
    penalty: Array
    free: Array

    def smoothed(self, smoothing: float) -> Block:
        """Return the block with its penalty times ``smoothing``, relative to the data."""
        size = float(np.sum(self.columns**2)) / max(float(np.trace(self.penalty)), 1e-300)
        return Block(self.columns, smoothing * size * self.penalty, self.free)

    def without(self, other: Array) -> Block | None:
        """Return the block orthogonal to other columns (n, p); None if nothing is left."""
        further = scipy.linalg.null_space(other.T @ self.columns, rcond=_NULL)
        if not further.shape[1]:
            return None
        penalty = further.T @ self.penalty @ further
        return Block(self.columns @ further, penalty, self.free @ further)


def block(columns: Array, penalty: Array, shared: Array) -> Block | None:
    """Return the block of weighted columns (n, m); None if nothing is left.

    ``shared`` (p, m): products of the columns with what is protected, which free coefficients make zero.
    """
    scale = np.sqrt(np.sum(columns**2))
    if scale <= 0:
        return None
    free = np.eye(columns.shape[1])
    if np.any(shared):
        free = scipy.linalg.null_space(shared / scale, rcond=_NULL)
    left = columns @ free
    if not free.shape[1] or np.sqrt(np.sum(left**2)) < _NULL * scale:
        return None
    return Block(left, free.T @ penalty @ free, free)


def orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis (n, r) of columns (n, p), each at its own scale."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    used = np.asarray(columns[:, size > 0] / size[size > 0])
    if not used.shape[1]:
        return used
    left, values, _ = np.linalg.svd(used, full_matrices=False)
    return np.asarray(left[:, values > _NULL * values[0]])


@dataclass(frozen=True, eq=False)
class Joint:
    """Blocks fitted together: columns side by side (n, m), and their penalty (m, m)."""

    columns: Array
    penalty: Array

    @classmethod
    def of(cls, blocks: Sequence[Block]) -> Joint:
        """Join blocks; none gives no columns."""
        penalty = scipy.linalg.block_diag(*(b.penalty for b in blocks))
        return cls(np.hstack([b.columns for b in blocks]), penalty)

    def solved(self, y: Array) -> Array:
        """Return the coefficients (m,) of all data."""
        return self._of(self.columns.T @ self.columns, self.columns.T @ y)

    def _of(self, gram: Array, moment: Array) -> Array:
        return np.asarray(scipy.linalg.solve(gram + self.penalty, moment, assume_a="pos"))

    def held_out(self, y: Array, fold: Labels) -> Array:
        """Return the prediction (n,) of each sample by the data of the other folds."""
        gram, moment = self.columns.T @ self.columns, self.columns.T @ y
        out = np.zeros(len(y))
        for k in np.unique(fold):
            mine = fold == k
            x = self.columns[mine]
            out[mine] = x @ self._of(gram - x.T @ x, moment - x.T @ y[mine])
        return out

    def held_out_loss(self, y: Array, fold: Labels, penalties: Sequence[Array]) -> Array:
        """Return the sum of squared held-out errors for each penalty (n_penalties,)."""
        parts = [(self.columns[fold == k], y[fold == k]) for k in np.unique(fold)]
        grams = [(x.T @ x, x.T @ part, float(part @ part)) for x, part in parts]
        gram, moment = sum(g for g, _, _ in grams), sum(m for _, m, _ in grams)
        out = np.zeros(len(penalties))
        for mine, own, squares in grams:
            rest = np.stack([gram - mine + penalty for penalty in penalties])
            found = np.linalg.solve(
                rest, np.broadcast_to(moment - own, (len(rest), len(own)))[..., None]
            )[..., 0]
            out += squares - 2 * found @ own + np.einsum("ki,ij,kj->k", found, mine, found)
        return out

    def covariance(self, variance: float) -> Array:
        """Return the covariance (m, m) of the coefficients, with the penalty as their prior (Wahba 1983)."""
        gram = self.columns.T @ self.columns + self.penalty
        return np.asarray(variance * np.linalg.inv(gram))


def correlated(error: Array, parts: Sequence[slice]) -> float:
    """Return how many samples of an error (n,) count as one: 1 + 2 sum of autocorrelations up to the first below zero.

    ``parts``: the samples of each log.
    """
    size = float(error @ error)
    longest = max(part.stop - part.start for part in parts)
    total, lag = 1.0, 1
    while lag < longest // 2 and size > 0:
        both = sum(float(error[p][:-lag] @ error[p][lag:]) for p in parts if p.stop - p.start > lag)
        if both <= 0:
            break
        total += 2 * both / size
        lag += 1
    return total
