"""Shares of the effort that give the most information: convex, with a certificate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import positive, reals, whole
from axisight.display.summary import summarized
from axisight.errors import InputError

Real = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False)
class OptimalShares:
    """Shares of the effort over candidates, and the proof of how good they are.

    shares
        (n_candidates,), at least zero, with sum one.
    dispersion
        d_k, (n_candidates,): minus the derivative of the criterion by the share of candidate k.
    gap
        Largest d_k minus the mean of d_k by shares. The criterion is at most this above its minimum.
        It is relative to the criterion for a weight, and to the number of parameters without one.
    criterion
        ``-log det M``, or ``trace(weight M^-1)``; the mean over models if there are several.
    iterations, status
        Number of iterations; ``"converged"`` if the gap reached the tolerance, else
        ``"max_iterations"``: use more iterations, or accept the gap.
    """

    shares: Real
    dispersion: Real
    gap: float
    criterion: float
    iterations: int
    status: Literal["converged", "max_iterations"]


def optimal_shares(
    information: ArrayLike,
    *,
    weight: ArrayLike | None = None,
    prior: ArrayLike | None = None,
    tolerance: float = 1e-4,
    max_iterations: int = 20_000,
) -> OptimalShares:
    """Return the shares w that make ``M = prior + sum_k w_k M_k`` most informative.

    information
        M_k of every candidate if it got the whole effort, (n_candidates, n, n), or
        (n_models, n_candidates, n, n) for the mean criterion over several models.
    weight
        None minimizes ``-log det M`` (D-optimal). A matrix C (n, n), positive semi-definite,
        minimizes ``trace(C M^-1)``: the variance of one parameter (c-optimal), a sum of variances
        (A-optimal), or the mean variance of a function of the parameters.
    prior
        Information that is there anyway, (n, n) or one per model, (n_models, n, n).
    tolerance
        The search ends when ``gap`` is below it.
    max_iterations
        Limit of the iterations.

    Each iteration multiplies the share of k by ``(d_k / mean)^p``, p = 1 without and 1/2 with a weight.
    The equivalence theorem proves the result: the shares are optimal if and only if no d_k exceeds the
    mean, which without prior is n, or ``trace(C M^-1)``. Sources: Kiefer and Wolfowitz (1960);
    Titterington (1976); Fellman (1974); Yu (2010).

    Raises InputError for shapes that do not fit, and if all candidates together do not determine all
    parameters.
    """
    matrices = _stacked(information)
    n = matrices.shape[-1]
    given = _matrices("prior", 0 * matrices[:, 0] if prior is None else prior, n, len(matrices))
    wanted = None if weight is None else _matrices("weight", weight, n, len(matrices))
    positive("tolerance", tolerance)
    whole("max_iterations", max_iterations)
    shares = np.full(matrices.shape[1], 1 / matrices.shape[1])
    _check_determined(given + matrices.mean(axis=1))
    power = 1.0 if wanted is None else 0.5
    flat = matrices.reshape(*matrices.shape[:2], n * n)
    iteration = 0
    while True:
        iteration += 1
        criterion, slopes = _slopes(given + (shares @ flat).reshape(-1, n, n), wanted)
        dispersion = (flat @ slopes.reshape(-1, n * n, 1)).sum(axis=0)[:, 0]
        mean = float(shares @ dispersion)
        gap = float(dispersion.max() - mean) / (n if wanted is None else criterion)
        if gap <= tolerance or iteration == max_iterations:
            break
        shares = shares * (dispersion / mean) ** power
        shares /= shares.sum()
    return OptimalShares(
        shares=shares,
        dispersion=dispersion,
        gap=gap,
        criterion=criterion,
        iterations=iteration,
        status="converged" if gap <= tolerance else "max_iterations",
    )


def _slopes(matrices: Real, weight: Real | None) -> tuple[float, Real]:
    """Return the criterion, and the matrices A with d_k = sum over models of trace(A M_k)."""
    # Parameters may differ by orders of magnitude in information.
    size = np.sqrt(np.einsum("sii->si", matrices))
    units = size[:, :, None] * size[:, None, :]
    inverse = np.linalg.inv(matrices / units) / units
    if weight is None:
        return -float(np.linalg.slogdet(matrices)[1].mean()), inverse / len(matrices)
    found = inverse @ weight @ inverse
    return float(np.einsum("sij,sji->s", weight, inverse).mean()), found / len(matrices)


def _stacked(information: ArrayLike) -> Real:
    what = "finite numbers of shape (n_candidates, n, n) or (n_models, n_candidates, n, n)"
    array = reals("information", information, what, (3, 4))
    array = array[None] if array.ndim == 3 else array
    if not array.size or array.shape[2] != array.shape[3]:
        raise InputError(f"information: expected {what}, got {array.shape}")
    return array


def _matrices(name: str, value: ArrayLike, n: int, n_models: int) -> Real:
    what = f"finite numbers of shape ({n}, {n}) or ({n_models}, {n}, {n})"
    array = reals(name, value, what, (2, 3))
    if array.shape not in ((n, n), (n_models, n, n)):
        raise InputError(f"{name}: expected {what}, got {array.shape}")
    return np.broadcast_to(array, (n_models, n, n))


def _check_determined(matrices: Real) -> None:
    """Raise InputError if the information of all candidates together is singular to rounding."""
    for matrix in matrices:
        size = np.sqrt(np.diag(matrix))
        if (size <= 0).any() or not np.linalg.eigvalsh(matrix / np.outer(size, size))[0] > 1e-13:
            raise InputError(
                "information: expected candidates that together determine all parameters; leave "
                "out a parameter, or add candidates"
            )
