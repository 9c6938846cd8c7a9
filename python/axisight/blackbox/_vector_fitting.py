"""Vector fitting with common poles: relaxed, element by element through QR.

Gustavsen and Semlyen (1999), Gustavsen (2006) for the relaxed constraint, Deschrijver et al.
(2008) for the elimination of the residues. With sigma = basis @ c + d, the problem

    sigma G = numerators,   Re sum_k sigma(x_k) = number of lines

is linear in c, d and the numerators; the zeros of sigma are the next poles.
"""

from __future__ import annotations

import numpy as np

from axisight.blackbox._data import Complex
from axisight.blackbox._sections import Domain, Sections, Weighted
from axisight.statistics.least_squares import scaled_solution

SMALL_CONSTANT = 1e-8
"""Least size of d; a smaller one would move the zeros of sigma to infinity."""

ROUNDING = 1e-14
"""Share of the largest singular value below which a direction is rounding."""

NO_RATE = 1e-12
"""Poles below this size are at zero, apart from rounding."""


def relocated(problem: Weighted, sections: Sections) -> Complex:
    """Return the poles after one iteration."""
    x = problem.x
    basis = sections.basis(x)
    columns = problem.columns(sections)
    n, n_known = sections.order, columns.shape[1]
    g = problem.values.T[:, :, None]
    known = np.broadcast_to(columns, (len(g), *columns.shape))
    rows = problem.rows(np.concatenate([known, -basis * g, -g], axis=2))
    # QR eliminates the numerators of each element.
    r = np.asarray(np.linalg.qr(rows, mode="r"))
    stacked = r[:, n_known:, n_known:].reshape(-1, n + 1)
    # The constraint gets the weight of the data.
    weight = np.linalg.norm(stacked[:, n]) / len(x)
    constraint = weight * np.concatenate([basis.real.sum(axis=0), [len(x)]])
    target = np.zeros(len(stacked) + 1)
    target[-1] = weight * len(x)
    theta = scaled_solution(np.vstack([stacked, constraint]), target, ROUNDING)
    if abs(theta[n]) < SMALL_CONSTANT:
        theta = np.append(scaled_solution(stacked[:, :n], -stacked[:, n], ROUNDING), 1.0)
    return sections.zeros(theta[:n], float(theta[n]))


def fitted(
    problem: Weighted, start: Complex, domain: Domain, *, stable: bool, iterations: int
) -> tuple[Sections, float, int, bool]:
    """Return the best sections found, their loss, iterations done, and whether poles settled."""
    sections = Sections.of_poles(start)
    best, least = sections, problem.residues(sections).loss
    for k in range(1, iterations + 1):
        poles = relocated(problem, sections)
        if stable:
            poles = domain.stabilized(poles)
        if not np.isfinite(poles).all():
            return best, least, k, False
        following = Sections.of_poles(_conjugate(poles))
        loss = problem.residues(following).loss
        moved = _moved(sections.poles(), following.poles())
        sections = following
        if loss < least:
            best, least = following, loss
        if moved < 1e-9:
            return best, least, k, True
    return best, least, iterations, False


def _conjugate(poles: Complex) -> Complex:
    """Return the poles, made real where the imaginary part is nearly zero."""
    real = np.abs(poles.imag) <= 1e-12 * np.abs(poles)
    return np.asarray(np.where(real, poles.real + 0j, poles))


def _moved(old: Complex, new: Complex) -> float:
    # The band lies about one, so a pole this much slower counts as zero.
    size = np.maximum(np.abs(new), NO_RATE)
    distance = np.abs(old[:, None] - new[None, :]) / size[None, :]
    return float(np.max(np.min(distance, axis=0)))
