"""Search for the best motion of a stretch: refined starts, which are then mixed and moved.

Dry friction gives the cost many optima: one for each order of reversals. Refinement begins with soft friction and
ends with nearly hard one. Then motions exchange axes, or one axis gets a bump in time; what costs less is kept.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from kuka_forward_motion import INFLATION, SOFT_RAD_S, Coefficients, MotionEstimator
from numpy.typing import NDArray

Array = NDArray[np.float64]
Found = tuple[float, Coefficients]

LAST = (INFLATION, SOFT_RAD_S, 15)
# Inflation of the torque error, softening of dry friction [rad/s], and steps, from coarse to fine.
FROM_ROUGH = ((3.0, 0.1, 6), (3.0, 0.05, 6), (3.0, 0.02, 8), (3.0, 0.01, 10), LAST)
FROM_NEAR = ((3.0, 0.05, 4), (3.0, 0.02, 4), (3.0, 0.01, 4), LAST)
EXCHANGED = 0.4
"""Share of axes that one motion takes from another."""
BUMP_SAMPLES = (15.0, 80.0)
"""Widths of a bump in time, 1.5 to 8 s."""
SLOW_AXES = (0, 1)
"""Axes 1 and 2 get most bumps: they are slow, and their friction is ambiguous."""
ALIKE = 1.0
"""Motions whose costs differ by less are the same optimum."""


def refined(
    estimator: MotionEstimator,
    u: Array,
    c: Coefficients,
    stages: Sequence[tuple[float, float, int]] = FROM_ROUGH,
) -> Found:
    """Return cost and coefficients after stages of decreasing softening."""
    cost = np.inf
    for inflate, soft, steps in stages:
        cost, c = estimator.improve(u, c, soft, inflate, steps)
    return cost, c


def searched(
    estimator: MotionEstimator,
    u: Array,
    starts: Sequence[Coefficients],
    rounds: int,
    rng: np.random.Generator,
) -> list[Found]:
    """Return as many motions as starts, best first, after rounds of exchange and bumps."""
    pool = sorted((refined(estimator, u, c) for c in starts), key=lambda f: f[0])
    for _ in range(rounds):
        cost, c = refined(estimator, u, _varied(estimator, pool, rng), FROM_NEAR)
        if cost < pool[-1][0] and min(abs(cost - other) for other, _ in pool) > ALIKE:
            pool = sorted([*pool[:-1], (cost, c)], key=lambda f: f[0])
    return pool


def _varied(
    estimator: MotionEstimator, pool: list[Found], rng: np.random.Generator
) -> Coefficients:
    """Return one of the motions, rather a good one, with axes of another or with a bump."""
    one, other = min(rng.integers(len(pool), size=2)), rng.integers(len(pool))
    c = pool[one][1].copy()
    if rng.random() < 0.5 and one != other:
        axes = rng.random(6) < EXCHANGED
        c[:, axes] = pool[other][1][:, axes]
        return c
    n = estimator.prior.shapes.shape[1]
    axis = rng.choice(SLOW_AXES) if rng.random() < 0.7 else rng.integers(6)
    middle, width = rng.uniform(0.1 * n, 0.9 * n), rng.uniform(*BUMP_SAMPLES)
    bump = np.exp(-0.5 * ((np.arange(n) - middle) / width) ** 2)
    c[:, axis] += rng.normal() * estimator.prior.size_rad[axis] * estimator.coefficients(bump)
    return c
