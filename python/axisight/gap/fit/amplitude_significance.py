"""Significance of the size of an effect, from re-fits that leave out one stretch of time each.

An effect may show in a few stretches only: viscous friction shows in the fast ones. Its gain is then uneven, and a test
of the gain is never sure. But if those stretches agree on its size, the effect is there.

The delete-one-group jackknife measures this agreement. It needs no white residuals, and a size that depends on one
stretch vanishes without it (Efron 1982, *The Jackknife, the Bootstrap and Other Resampling Plans*, chapter 3;
Hotelling's T^2 for several sizes).
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import steps_without_each
from axisight.statistics.tails import log_fisher_tail

Array = NDArray[np.float64]

# Marks of shapes that need not be fitted: they belong to a way of writing the law, or may be idle.
_UNUSED = {"notation", "optional"}


def amplitude_significance(fitted: FittedModel, stretch: NDArray[np.int64]) -> float:
    """Return how surely the last effect's amplitudes differ from the simulator's [standard deviations of a normal].

    ``stretch`` (n_blocks,): the stretch of time of each block. Zero without an effect, for amplitudes whose neutral
    value is not zero, and if the stretches are too few for the number of amplitudes.
    """
    columns = _amplitudes(fitted)
    groups = np.unique(stretch)
    if not columns or len(groups) < 2:
        return 0.0
    moved = steps_without_each(fitted, stretch)[:, columns]
    # An amplitude that no re-fit moves is next to a bound. It is left out, like those on a bound.
    free = np.any(moved != 0.0, axis=0)
    if not free.any():
        return 0.0
    columns, moved = [i for i, moves in zip(columns, free, strict=True) if moves], moved[:, free]
    size = np.array([_change(fitted, i) for i in columns])
    scatter = (len(groups) - 1) / len(groups) * moved.T @ moved
    freedom = min(_freedom(fitted, stretch, columns), len(groups) - 1)
    left = freedom - len(columns) + 1
    # With fewer than two spare degrees of freedom, a single stretch could decide.
    if left < 2:
        return 0.0
    scale = np.sqrt(np.maximum(np.diag(scatter), 1e-300))
    # Two amplitudes of the same shape make the matrix nearly singular. The ridge treats them as one.
    normal = scatter / np.outer(scale, scale) + 1e-9 * np.eye(len(columns))
    square = float((size / scale) @ np.linalg.solve(normal, size / scale))
    tail = log_fisher_tail(square * left / (freedom * len(columns)), len(columns), left)
    # The tail of a single size holds both signs, a normal deviate only one. Values above 37 exceed floating point.
    return max(0.0, float(-scipy.special.ndtri_exp(tail))) if tail > -700 else 37.0


def _amplitudes(fitted: FittedModel) -> list[int]:
    """Return the columns of the last effect's amplitudes, without those on a bound.

    Empty if the shape of the effect was chosen from many, such as a ripple order: the best of many shapes has a size in
    any noise. A shape that no fit needs was not chosen.
    """
    last = len(fitted.effects) - 1
    if last < 0:
        return []
    info, free = effect_info(fitted.effects[last].name), fitted.free[last].free
    shapes = [p for p in info.parameters if p.role == "shape" and not _UNUSED & {*p.marks}]
    if any(p.name not in free for p in shapes):
        return []
    sizes = {p.name for p in info.parameters if p.role == "amplitude" and p.neutral == 0}
    return [
        i
        for i, (place, name) in enumerate(fitted.parameters)
        if place == last and name in sizes and (place, name) not in fitted.at_bound
    ]


def _change(fitted: FittedModel, column: int) -> float:
    """Return the difference between a fitted amplitude and the value that the simulator states, zero by default."""
    name = fitted.parameters[column][1]
    stated = fitted.free[-1].stated.get(name, 0.0)
    return float((fitted.effects[-1].parameters or {})[name]) - stated


def _freedom(fitted: FittedModel, stretch: NDArray[np.int64], columns: list[int]) -> float:
    """Return the degrees of freedom of the scatter: the number of stretches that share the information.

    Satterthwaite's formula, with the shares of the variance that white residuals would give. The smallest over all
    amplitudes.
    """
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    size = np.sqrt(np.diag(matrix))
    # A parameter without influence has no share.
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 1e-100)
    normal = matrix * np.outer(scale, scale) + 1e-9 * np.eye(len(matrix))
    pull = np.linalg.solve(normal, np.diag(scale)[:, columns]) * scale[:, None]
    by_block = np.einsum("ia,bij,ja->ba", pull, fitted.matrix, pull)
    shares = np.array([by_block[stretch == g].sum(axis=0) for g in np.unique(stretch)])
    whole = np.maximum(shares.sum(axis=0), 1e-300)
    return float((whole**2 / np.maximum((shares**2).sum(axis=0), 1e-300)).min())
