"""The most informative distribution of a limited effort: convex, with a certificate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import positive, reals, shown, whole
from axisight.display.summary import summarized
from axisight.errors import InputError

Real = NDArray[np.float64]

PRICE_STEP = 0.2
"""Power of the relative use of a limit by which its price changes in an iteration.

The step of the amounts takes the prices times the relative use itself. Without this the prices would
oscillate where two spectra are equally good.
"""


@summarized
@dataclass(frozen=True, eq=False)
class OptimalEffort:
    """Effort of every candidate, and the proof of how good it is.

    amounts
        a_k, (n_candidates,), at least zero; the largest use of a limit is one.
    prices
        Weights of the limits, (n_limits,), with sum one. A limit that does not bind has price zero.
    dispersion
        d_k, (n_candidates,): fall of the criterion per effort for candidate k, at these prices, relative
        to the mean over the effort. No value exceeds one at the optimum, and all used ones equal one.
    criterion
        ``-log det M``, or ``log trace(weight M^-1)``; the mean over models if there are several.
    gap
        The criterion is at most this above its minimum.
    iterations, status
        Number of iterations; ``"converged"`` if the gap reached the tolerance, else
        ``"max_iterations"``: use more iterations, or accept the gap.
    """

    amounts: Real
    prices: Real
    dispersion: Real
    criterion: float
    gap: float
    iterations: int
    status: Literal["converged", "max_iterations"]


def optimal_effort(
    information: ArrayLike,
    *,
    weight: ArrayLike | None = None,
    costs: ArrayLike | None = None,
    prior: ArrayLike | None = None,
    tolerance: float = 1e-3,
    max_iterations: int = 10_000,
) -> OptimalEffort:
    """Return the amounts a that make ``M = prior + sum_k a_k M_k`` most informative within limits.

    information
        M_k of one unit of every candidate, (n_candidates, n, n), or (n_models, n_candidates, n, n) for
        the mean criterion over several models.
    weight
        None minimizes ``-log det M`` (D-optimal). A matrix C (n, n), positive semi-definite,
        minimizes ``log trace(C M^-1)``: the variance of one parameter (c-optimal), a sum of variances
        (A-optimal), or the mean variance of a function of the parameters.
    costs
        Use of each limit by one unit of a candidate, positive, (n_limits, n_candidates): the amounts
        keep ``costs @ a <= 1``. None limits the sum of the amounts.
    prior
        Information that is there anyway, (n, n) or one per model, (n_models, n, n).
    tolerance
        The search ends when ``gap`` is below it. For a weight, 1e-3 is 0.1 % of the variance.
    max_iterations
        Limit of the iterations.

    Each iteration multiplies a_k by a power of its dispersion, 1 without and 1/2 with a weight, and
    the prices by a power of the use of their limits. With prices p and the derivative d_k of the
    criterion, ``gap = max_k d_k / (p @ costs)_k - sum_k a_k d_k`` bounds the distance from the optimum
    for any amounts within the limits, because the criterion is convex (equivalence theorem). Sources:
    Kiefer and Wolfowitz (1960); Titterington (1976); Fellman (1974); Yu (2010).

    Raises InputError for shapes that do not fit, and if all candidates together do not determine all
    parameters.
    """
    matrices = _stacked(information)
    n_models, count, n = matrices.shape[:3]
    given = _matrices("prior", 0 * matrices[:, 0] if prior is None else prior, n, n_models)
    wanted = None if weight is None else _matrices("weight", weight, n, n_models)
    use = _costs(costs, count)
    positive("tolerance", tolerance)
    whole("max_iterations", max_iterations)
    prices = np.full(len(use), 1 / len(use))
    amounts = 1 / (prices @ use)
    amounts /= np.max(use @ amounts)
    _check_determined(given + np.einsum("k,skij->sij", amounts, matrices))
    power = 1.0 if wanted is None else 0.5
    flat = matrices.reshape(n_models, count, n * n)
    iteration = 0
    while True:
        iteration += 1
        criterion, slopes = _slopes(given + (amounts @ flat).reshape(-1, n, n), wanted)
        slope = (flat @ slopes.reshape(-1, n * n, 1)).sum(axis=0)[:, 0]
        cost = prices @ use
        value = float(amounts @ slope)
        gap = float(np.max(slope / cost)) - value
        dispersion = slope / cost * float(amounts @ cost) / value
        if gap <= tolerance or iteration == max_iterations:
            break
        charged = (prices * (use @ amounts)) @ use
        amounts = amounts * (slope / charged * float(amounts @ charged) / value) ** power
        used = use @ amounts
        amounts /= used.max()
        prices *= (used / used.max()) ** PRICE_STEP
        prices /= prices.sum()
    return OptimalEffort(
        amounts=amounts,
        prices=prices,
        dispersion=dispersion,
        criterion=criterion,
        gap=gap,
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
    variance = np.einsum("sij,sji->s", weight, inverse)
    found = inverse @ weight @ inverse / variance[:, None, None]
    return float(np.log(variance).mean()), found / len(matrices)


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


def _costs(costs: ArrayLike | None, count: int) -> Real:
    if costs is None:
        return np.ones((1, count))
    what = f"positive numbers of shape (n_limits, {count})"
    use = reals("costs", costs, what, 2)
    if use.shape[1] != count or not len(use) or not (use > 0).all():
        raise InputError(f"costs: expected {what}, got {shown(use)}")
    return use


def _check_determined(matrices: Real) -> None:
    """Raise InputError if the information of all candidates together is singular to rounding."""
    for matrix in matrices:
        size = np.sqrt(np.diag(matrix))
        if (size <= 0).any() or not np.linalg.eigvalsh(matrix / np.outer(size, size))[0] > 1e-13:
            raise InputError(
                "information: expected candidates that together determine all parameters; leave "
                "out a parameter, or add candidates"
            )
