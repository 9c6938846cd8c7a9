"""Covariance of a least-squares estimate from the scatter of clusters of equations.

This is the sandwich covariance. It holds for any correlation of residuals within a cluster, and for any
variances. The correction CR2 (Bell and McCaffrey 2002) enlarges each cluster's residuals by the part
that the fit has absorbed, so that the covariance is unbiased for white residuals.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]

DECIDED = 1e-8
"""A cluster alone decides a direction if the fit leaves less than this share of its residual."""

LEAST_SHOWN = 0.5
"""Least share of the variance of a parameter that its scatter must show."""


@dataclass(frozen=True, eq=False)
class ClusterScatter:
    """The scatter of clusters of equations about an estimate.

    Cluster b has the equations ``X_b p = y_b``, including weights. W is a root
    ``W W^T = (sum_b X_b^T X_b)^-1``.

    root
        W, shape (n_parameters, n_columns).
    lever
        X_b W, shape (n_clusters, n_equations, n_columns).
    residual
        X_b p - y_b, shape (n_clusters, n_equations).
    score
        Contribution to the estimate besides ``lever^T residual``, shape (n_clusters, n_columns), for
        example from errors in the columns of X; usually zero.
    """

    root: Real
    lever: Real
    residual: Real
    score: Real | float = 0.0

    @cached_property
    def _enlarged(self) -> Real:
        """(I - H_b)^(-1/2) of every cluster, zero for directions that it alone decides."""
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
        """Covariance (n_parameters, n_parameters), NaN for parameters whose variance does not show."""
        score = np.einsum("bij,bi->bj", self._pull, self.residual) + self.score
        change = score @ self.root.T
        found = np.asarray(change.T @ change, dtype=np.float64)
        hidden = ~self.shown
        found[hidden], found[:, hidden] = np.nan, np.nan
        return found

    @cached_property
    def shown(self) -> NDArray[np.bool_]:
        """Whether the scatter of a parameter shows its variance, shape (n_parameters,).

        It does not with as many equations as parameters, or if a single cluster decides the parameter,
        because the residuals are then zero and do not scatter.
        """
        # The expected scatter for white residuals.
        moved = self._pull @ self.root.T
        left = moved - self.lever @ (self.lever.swapaxes(-1, -2) @ moved)
        mean = np.einsum("bij,bij->j", moved, left)
        return np.asarray(mean >= LEAST_SHOWN * np.einsum("ij,ij->i", self.root, self.root))

    @cached_property
    def degrees_of_freedom(self) -> Real:
        """Degrees of freedom of the scatter of each parameter, shape (n_parameters,).

        They follow from Satterthwaite's rule for white residuals, and are 0 for parameters whose
        variance does not show.
        """
        return np.array(
            [self._freedom(row) if s else 0.0 for row, s in zip(self.root, self.shown, strict=True)]
        )

    def _freedom(self, row: Real) -> float:
        u = self._pull @ row
        s = np.einsum("bij,bi->bj", self.lever, u)
        g = np.diag((u**2).sum(axis=1)) - s @ s.T
        return float(np.trace(g)) ** 2 / float((g**2).sum())
