"""Which parameters really vary between runs: one Gauss-Newton step of each log from the joint fit, with a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.rank_deficiency import pseudo_inverse
from axisight.gap.search.balanced_values import stretches
from axisight.posterior.between_runs import BetweenRuns
from axisight.posterior.settings import DETERMINED, FALSE_ALARMS, TELLS

Array = NDArray[np.float64]


def between_runs(at: FittedModel, names: Sequence[str], same: Array) -> tuple[BetweenRuns, ...]:
    """Return the variation of each parameter (p,) between logs; ``names``: those of the parameters of ``at``.

    Each log k takes one step from the joint fit, held to it by the tolerances: d = -(M_k + P)^-1 g_k, with the log's
    normal equations M_k and gradient g_k. A true change u moves it by A u, A = (M_k + P)^-1 M_k, so d is divided by the
    diagonal of A. A log does not determine a parameter if that is below one half, or if the log has less than 5 % of
    the information of an average log.

    The noise of d comes from the scatter of what is left between the stretches of the log. ``same`` (p,) is added in
    squares: estimates that differ by no more than errors of formulas count as the same. Where it is infinite, nothing
    is tested. Welch's test compares the estimates, since logs have different noise (Welch 1951, Biometrika 38(3/4)).
    Their excess over the noise is the variance between runs (DerSimonian and Laird 1986, Controlled Clinical Trials
    7(3)). All tests together have 5 % false alarms (Holm 1979).
    """
    told = [np.diag(at.matrix[at.log == log].sum(axis=0)) for log in np.unique(at.log)]
    enough = TELLS * np.mean(told, axis=0)
    logs = [
        _of_log(at, log, mine >= enough) for log, mine in zip(np.unique(at.log), told, strict=True)
    ]
    estimate = np.array([one.estimate for one in logs])
    tested = [_tested(logs, j, float(same[j])) for j in range(len(names))]
    varies = _holm([p for _, p in tested])
    return tuple(
        BetweenRuns(name, std if varies[j] else 0.0, p, varies[j], tuple(estimate[:, j].tolist()))
        for j, (name, (std, p)) in enumerate(zip(names, tested, strict=True))
    )


@dataclass(frozen=True)
class _OfLog:
    """Estimates of one log less the joint ones (p,), NaN if it does not determine them, and their variance.

    ``freedom``: degrees of freedom of the variance, which comes from the scatter of so many stretches less one.
    """

    estimate: Array
    variance: Array
    freedom: int


def _of_log(at: FittedModel, log: int, tells: NDArray[np.bool_]) -> _OfLog:
    """Return the estimates of a log; ``tells`` (p,): on which parameters it has enough information."""
    mine = at.log == log
    number = stretches(at)[mine]
    matrix, gradient = at.matrix[mine], at.gradient[mine]
    known = pseudo_inverse(matrix.sum(axis=0) + at.prior_matrix)
    recovered = np.diag(known @ matrix.sum(axis=0))
    free = np.array([name not in at.at_bound for name in at.parameters], dtype=bool)
    used = free & tells & (recovered > DETERMINED)
    step = -known @ gradient.sum(axis=0)
    # What the step of the log leaves in each of its stretches, as a change of the parameters.
    left = gradient + matrix @ step
    parts = np.unique(number)
    moved = np.array([left[number == part].sum(axis=0) for part in parts]) @ known
    freedom = len(parts) - 1
    scale = np.where(used, recovered, 1.0)
    variance = np.sum(moved**2, axis=0) * len(parts) / max(freedom, 1) / scale**2
    if freedom < 1:
        used = np.zeros_like(used)
    return _OfLog(np.where(used, step / scale, np.nan), variance, freedom)


def _tested(logs: Sequence[_OfLog], column: int, same: float) -> tuple[float, float | None]:
    """Return the standard deviation of a parameter between runs, and the p-value of its test; None without a test."""
    used = [one for one in logs if np.isfinite(one.estimate[column]) and np.isfinite(same)]
    count = len(used)
    if count < 2:
        return 0.0, None
    value = np.array([one.estimate[column] for one in used])
    noise = np.array([one.variance[column] for one in used])
    variance = np.maximum(noise + same**2, 1e-300)
    weight = 1 / variance
    total = float(weight.sum())
    q = float(weight @ (value - weight @ value / total) ** 2)
    # Only the noise is estimated; the share of ``same`` is known.
    free = np.array([one.freedom for one in used]) * (variance / np.maximum(noise, 1e-300)) ** 2
    spread = float(np.sum((1 - weight / total) ** 2 / free))
    ratio = q / (count - 1) / (1 + 2 * (count - 2) / (count**2 - 1) * spread)
    freedom = (count**2 - 1) / (3 * max(spread, 1e-12))
    p = float(scipy.special.fdtrc(count - 1, freedom, ratio))
    base = total - float((weight**2).sum()) / total
    return float(np.sqrt(max(0.0, (q - (count - 1)) / base))), p


def _holm(p_values: Sequence[float | None]) -> list[bool]:
    """Return which tests reject, with a probability of a false alarm among all of them of `FALSE_ALARMS`."""
    order = sorted((p, i) for i, p in enumerate(p_values) if p is not None)
    out = [False] * len(p_values)
    for done, (p, i) in enumerate(order):
        if p > FALSE_ALARMS / (len(order) - done):
            break
        out[i] = True
    return out
