"""Polynomial models by the prediction-error method, Wernholt (2004), (3.21) and (3.31)-(3.34).

    sum_j A_ij(q) y_j(t) = sum_j B_ij(q) / F_ij(q) u_j(t) + C_i(q) / D_i(q) e_i(t)

`armax` and `box_jenkins` are its common cases; ARX and output error are its cases too. Each output is
a problem of its own, solved by a trust-region search with exact gradients that rejects unstable
predictors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from axisight.arguments import one_of
from axisight.blackbox._data import Real, gathered, order_matrix, whole
from axisight.blackbox.prediction_error._row import (
    RowOrders,
    RowPolynomials,
    RowProblem,
    polynomials,
)
from axisight.blackbox.prediction_error._start import starts_of
from axisight.blackbox.prediction_error.model import PolynomialModel
from axisight.errors import InputError
from axisight.records.experiment import Experiment
from axisight.statistics.least_squares import inverse_root

NEAR_CIRCLE = 1e-3
"""Roots of C this near the unit circle are reported: standard errors do not hold there."""

RANKING = ("rank_deficient", "max_evaluations", "converged")


@dataclass(frozen=True)
class _Row:
    """The result of one output."""

    problem: RowProblem
    theta: Real
    status: str
    evaluations: int
    residual: Real
    jacobian: Real
    root: Real | None
    """R with R R^T the inverse of the squared Jacobian; None if the data do not determine it."""

    @property
    def freedom(self) -> int:
        return self.problem.n_rows - len(self.theta)


def armax(
    experiments: Experiment | Sequence[Experiment],
    *,
    na: ArrayLike,
    nb: ArrayLike,
    nc: ArrayLike,
    nk: ArrayLike = 1,
    initial: str = "estimate",
    max_evaluations: int = 200,
) -> PolynomialModel:
    """Return the ARMAX model ``A y = B u + C e`` of one or several experiments.

    ``na`` (p, p), ``nb`` and ``nk`` (p, m) and ``nc`` (p,) are orders, or one number for all.
    ``experiments``, ``initial``, ``max_evaluations``, results and errors are those of
    `polynomial_model`. The plant may integrate or be unstable, because A may be.
    """
    return polynomial_model(
        experiments,
        na=na,
        nb=nb,
        nc=nc,
        nk=nk,
        initial=initial,
        max_evaluations=max_evaluations,
    )


def box_jenkins(
    experiments: Experiment | Sequence[Experiment],
    *,
    nb: ArrayLike,
    nc: ArrayLike,
    nd: ArrayLike,
    nf: ArrayLike,
    nk: ArrayLike = 1,
    initial: str = "estimate",
    max_evaluations: int = 200,
) -> PolynomialModel:
    """Return the Box-Jenkins model ``y = B/F u + C/D e`` of one or several experiments.

    ``nb``, ``nf`` and ``nk`` (p, m) and ``nc``, ``nd`` (p,) are orders, or one number for all.
    ``experiments``, ``initial``, ``max_evaluations``, results and errors are those of
    `polynomial_model`. Plant and noise share no dynamics, so a wrong noise model does not disturb the
    plant in open loop. The plant must be stable.
    """
    return polynomial_model(
        experiments,
        nb=nb,
        nc=nc,
        nd=nd,
        nf=nf,
        nk=nk,
        initial=initial,
        max_evaluations=max_evaluations,
    )


def polynomial_model(
    experiments: Experiment | Sequence[Experiment],
    *,
    nb: ArrayLike,
    na: ArrayLike = 0,
    nc: ArrayLike = 0,
    nd: ArrayLike = 0,
    nf: ArrayLike = 0,
    nk: ArrayLike = 1,
    initial: str = "estimate",
    max_evaluations: int = 200,
) -> PolynomialModel:
    """Return the model (3.21) with the least sum of squared prediction errors (3.34).

    experiments
        `axisight.records.experiment.Experiment`, all with the same sample time and channels.
        Subtract offsets first: the model has none.
    na
        Lags of outputs, one number or (p, p).
    nb, nk, nf
        Coefficients of B, lag of the first, and order of F, one number or (p, m). With nk = 0 the
        input acts within its sample.
    nc, nd
        Orders of C and D of the noise, one number or (p,).
    initial
        ``"estimate"`` frees the unknown past of every experiment; ``"zero"`` for experiments that
        begin at rest.
    max_evaluations
        Most evaluations of each search; every output has up to three, from different starts.

    In closed loop the estimate is consistent if the model can describe plant and noise, and every
    loop has a delay: nk at least 1 if the controller acts within the sample. Standard errors hold for
    white prediction errors: see `PolynomialModel.residual_tests`.

    Raises InputError for misuse and for experiments that are too short; non-convergence is a status.
    Source: Ljung (1999), chapters 4, 9 and 10.
    """
    data = gathered(experiments, "experiments")
    limit = whole("max_evaluations", max_evaluations, 1)
    one_of("initial", initial, ("estimate", "zero"))
    rows = _orders(data[0], na, nb, nc, nd, nf, nk)
    inputs, outputs = [e.input for e in data], [e.output for e in data]
    problems = [RowProblem(row, inputs, outputs, initial == "estimate") for row in rows]
    for problem in problems:
        wanted = problem.orders.n_parameters + problem.orders.memory
        if min(map(len, outputs)) <= problem.orders.memory or problem.n_rows <= wanted:
            raise InputError(
                f"experiments: expected more than {wanted} samples for these orders, got "
                f"{sum(map(len, outputs))}"
            )
    return _model([_searched(problem, limit) for problem in problems], data[0].sample_time_s)


def _orders(
    first: Experiment,
    na: ArrayLike,
    nb: ArrayLike,
    nc: ArrayLike,
    nd: ArrayLike,
    nf: ArrayLike,
    nk: ArrayLike,
) -> list[RowOrders]:
    p, m = first.output.shape[1], first.input.shape[1]
    a = order_matrix("na", na, (p, p), 0)
    b, f, k = (
        order_matrix(name, value, (p, m), 0) for name, value in (("nb", nb), ("nf", nf), ("nk", nk))
    )
    c, d = (order_matrix(name, value, (1, p), 0)[0] for name, value in (("nc", nc), ("nd", nd)))
    if np.any((f > 0) & (b == 0)):
        raise InputError("nf: expected 0 where nb is 0, because F without B has no effect")
    rows = [RowOrders(i, a[i], b[i], f[i], k[i], int(c[i]), int(d[i])) for i in range(p)]
    for row in rows:
        if not row.n_parameters:
            raise InputError(
                f"na, nb: expected at least one parameter for output {row.output + 1}, got none"
            )
    return rows


def _searched(problem: RowProblem, limit: int) -> _Row:
    results = [
        optimize.least_squares(
            problem.residual,
            start,
            problem.jacobian,
            method="trf",
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=limit,
        )
        for start in starts_of(problem)
    ]
    result = min(results, key=lambda found: float(found.cost))
    theta = np.asarray(result.x, np.float64)
    residual, jacobian = problem.residual(theta), problem.jacobian(theta)
    root = inverse_root(jacobian, len(residual) * np.finfo(float).eps)
    status = "max_evaluations" if result.status == 0 else "converged"
    return _Row(
        problem,
        theta,
        status if root is not None else "rank_deficient",
        sum(int(found.nfev) for found in results),
        residual,
        jacobian,
        root,
    )


def _warnings(row: _Row, p: RowPolynomials) -> list[str]:
    name = f"output {row.problem.orders.output + 1}"
    out = []
    if row.status == "rank_deficient":
        out.append(
            f"{name}: the data do not determine all parameters: lower the orders (poles and zeros "
            "that cancel), excite more, or use a richer controller"
        )
    if row.status == "max_evaluations":
        out.append(f"{name}: stopped at the limit; allow more evaluations")
    if np.any(np.abs(np.roots(p.c)) > 1 - NEAR_CIRCLE):
        out.append(
            f"{name}: a zero of the noise model is at the unit circle, so standard errors do not "
            "hold: lower nc, or do not difference the output"
        )
    if np.any(np.abs(np.roots(p.d)) >= 1):
        out.append(f"{name}: the noise model is unstable: remove drift, or lower nd")
    return out


def _model(rows: list[_Row], sample_time_s: float) -> PolynomialModel:
    found = [polynomials(row.problem.orders, row.theta) for row in rows]
    freedom = np.sqrt([max(row.freedom, 1) for row in rows])
    errors = np.stack([row.residual for row in rows])
    noise = errors @ errors.T / np.outer(freedom, freedom)
    return PolynomialModel(
        sample_time_s=sample_time_s,
        polynomials=tuple(found),
        orders=tuple(row.problem.orders for row in rows),
        values=np.concatenate([row.theta for row in rows]),
        covariance=_covariance(rows, noise),
        noise_covariance=noise,
        status=min((row.status for row in rows), key=RANKING.index),
        evaluations=sum(row.evaluations for row in rows),
        n_rows=min(row.problem.n_rows for row in rows),
        warnings=tuple(w for row, p in zip(rows, found, strict=True) for w in _warnings(row, p)),
    )


def _covariance(rows: list[_Row], noise: Real) -> Real:
    """Return the covariance of all parameters; outputs are correlated through their errors."""
    blocks = []
    for i, one in enumerate(rows):
        line = []
        for j, other in enumerate(rows):
            shape = (len(one.theta), len(other.theta))
            if one.root is None or other.root is None:
                line.append(np.full(shape, np.nan))
                continue
            inner = one.root.T @ (one.jacobian.T @ other.jacobian) @ other.root
            line.append(noise[i, j] * one.root @ inner @ other.root.T)
        blocks.append(line)
    whole_matrix = np.block(blocks)
    return np.asarray((whole_matrix + whole_matrix.T) / 2)
