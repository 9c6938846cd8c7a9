"""Covariance of a least-squares estimate from the scatter of clusters of equations.

The sandwich: right whatever the residuals of one cluster have to do with each other, and whatever
their variances. Each cluster's residuals are enlarged by what the fit has taken from them, so that
it is unbiased where residuals are white (Bell and McCaffrey 2002, the correction called CR2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]

DECIDED = 1e-8
"""Share of a residual that the fit leaves, below which its cluster alone decides a direction."""

LEAST_SHOWN = 0.5
"""Share of its variance that the scatter of a parameter must show to be called its variance."""


@dataclass(frozen=True, eq=False)
class ClusterScatter:
    """What clusters of equations say of an estimate.

    With the equations ``X_b p = y_b`` of cluster b, weights included, and a root
    ``W W^T = (sum_b X_b^T X_b)^-1``:

    root
        W, shape (n_parameters, n_columns).
    lever
        X_b W, shape (n_clusters, n_equations, n_columns).
    residual
        X_b p - y_b, shape (n_clusters, n_equations).
    score
        What moves the estimate besides ``lever^T residual``, shape (n_clusters, n_columns), as
        errors in the columns of X do; zero as a rule.
    """

    root: Real
    lever: Real
    residual: Real
    score: Real | float = 0.0

    @cached_property
    def _enlarged(self) -> Real:
        """(I - H_b)^(-1/2) of every cluster, zero where it alone decides."""
        share = self.lever @ self.lever.swapaxes(-1, -2)
        values, vectors = np.linalg.eigh(np.eye(share.shape[-1]) - share)
        shows = values > DECIDED
        grow = np.where(shows, 1.0 / np.sqrt(np.maximum(values, DECIDED)), 0.0)
        return np.asarray((vectors * grow[:, None, :]) @ vectors.swapaxes(-1, -2))

    @cached_property
    def _pull(self) -> Real:
        return np.asarray(self._enlarged @ self.lever)

    @cached_property
    def covariance(self) -> Real:
        """Of the parameters, shape (n_parameters, n_parameters); NaN where it does not show."""
        score = np.einsum("bij,bi->bj", self._pull, self.residual) + self.score
        change = score @ self.root.T
        found = np.asarray(change.T @ change, dtype=np.float64)
        hidden = ~self.shown
        found[hidden], found[:, hidden] = np.nan, np.nan
        return found

    @cached_property
    def shown(self) -> NDArray[np.bool_]:
        """Whether the scatter of a parameter shows its variance, shape (n_parameters,).

        It does not where there are as many equations as parameters, or where a single cluster
        decides: its residuals are zero then and scatter no more.
        """
        # The mean of the scatter, were residuals white.
        moved = self._pull @ self.root.T
        left = moved - self.lever @ (self.lever.swapaxes(-1, -2) @ moved)
        mean = np.einsum("bij,bij->j", moved, left)
        return np.asarray(mean >= LEAST_SHOWN * np.einsum("ij,ij->i", self.root, self.root))

    @cached_property
    def degrees_of_freedom(self) -> Real:
        """Of the scatter of each parameter, residuals taken as white; 0 where it does not show.

        Satterthwaite's rule; shape (n_parameters,).
        """
        return np.array(
            [self._freedom(row) if s else 0.0 for row, s in zip(self.root, self.shown, strict=True)]
        )

    def _freedom(self, row: Real) -> float:
        u = self._pull @ row
        s = np.einsum("bij,bi->bj", self.lever, u)
        g = np.diag((u**2).sum(axis=1)) - s @ s.T
        return float(np.trace(g)) ** 2 / float((g**2).sum())
