"""Samples of a mixture of Gaussians: each a function of seed and run alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Keeps these random numbers apart from those of other parts of the package with the same seed.
_STREAM = 0x706F73


@dataclass(frozen=True)
class Part:
    """One Gaussian of a mixture: its weight, the places of its p parameters among all, and its moments."""

    weight: float
    places: NDArray[np.int64]
    mean: Array
    covariance: Array


@dataclass(frozen=True)
class Mixture:
    """A mixture of Gaussians over n parameters with bounds (n, 2).

    ``neutral`` (n,): values of the parameters that a part lacks.
    """

    parts: tuple[Part, ...]
    neutral: Array
    bounds: Array

    def drawn(self, seed: int, runs: Iterable[int]) -> tuple[NDArray[np.int64], Array]:
        """Return the part that each run takes (n_runs,), and its values within the bounds (n_runs, n)."""
        roots = [square_root(part.covariance) for part in self.parts]
        weights = np.cumsum([part.weight for part in self.parts])
        which, rows = [], []
        for run in runs:
            rng = np.random.default_rng([seed, _STREAM, run])
            k = min(int(np.searchsorted(weights, rng.random() * weights[-1])), len(roots) - 1)
            part, value = self.parts[k], self.neutral.copy()
            value[part.places] = part.mean + roots[k] @ rng.standard_normal(len(part.places))
            which.append(k)
            rows.append(value)
        values = np.array(rows).reshape(-1, len(self.neutral))
        return np.array(which, dtype=np.int64), np.clip(values, *self.bounds.T)


def square_root(covariance: Array) -> Array:
    """Return the symmetric square root (p, p) of a covariance, which is unique also where it is singular."""
    size = np.sqrt(np.diag(covariance))
    scale = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    # The root of C = D R D that is returned is D R^1/2, and D R^1/2 (D R^1/2)' = C.
    return np.asarray(scale[:, None] * root)
