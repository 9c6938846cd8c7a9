"""Where the search for a polynomial model of one output starts.

A long ARX model is unbiased in open and closed loop. Its errors stand for the unknown e, so ARMAX
coefficients follow by regression (Hannan and Rissanen, 1982); B / F is the nearest model of its order. With
one input, the start of an output-error model also runs on data filtered by the long A, which makes
their noise white. C and D follow the same way from what the plant leaves. A Box-Jenkins loss has
local minima, so the search begins from several of these candidates.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import signal

from axisight.blackbox._data import Real
from axisight.blackbox._output_error_problem import (
    OutputErrorProblem,
    delayed,
    least_squares,
    refitted,
    stabilized,
)
from axisight.blackbox.prediction_error._row import RowOrders, RowProblem
from axisight.errors import InputError

LONG_ORDERS = (10, 30, 60)
"""Orders of the long ARX models to start from."""

SEARCHES = 3
"""Most starts of one search; more do not find lower losses."""

NEAR = 0.03
"""Distance of two starts, relative to their size, below which they count as one."""

Coefficients = dict[tuple[str, int], Real]
"""Coefficients by polynomial and channel, from the first free lag on."""


def starts_of(problem: RowProblem) -> list[Real]:
    """Return the best starts, the best first: at most `SEARCHES`, and one if the loss is quadratic.

    Raises InputError if no candidate has a stable predictor.
    """
    found: list[tuple[float, Real]] = []
    for plant in _plants(problem):
        best: tuple[float, Real] | None = None
        for noise in _noises(problem, plant):
            theta = _vector(problem.orders, {**plant, **noise})
            loss = problem.loss(theta)
            if np.isfinite(loss) and (best is None or loss < best[0]):
                best = loss, theta
        if best is not None:
            found.append(best)
    found.sort(key=lambda one: one[0])
    if not found:
        raise InputError(
            f"experiments: output {problem.orders.output + 1} has no model with a stable predictor "
            "to start from: lower nf for a plant that integrates, or record more samples"
        )
    linear = problem.orders.nc + problem.orders.nd + problem.orders.nf.sum() == 0
    return _different([theta for _, theta in found], 1 if linear else SEARCHES)


def _different(candidates: list[Real], most: int) -> list[Real]:
    """Return the first candidates that are not near an earlier one: near ones end at one minimum."""
    kept: list[Real] = []
    for theta in candidates:
        size = NEAR * np.linalg.norm(theta)
        if len(kept) < most and all(np.linalg.norm(theta - one) > size for one in kept):
            kept.append(theta)
    return kept


def _vector(orders: RowOrders, found: Coefficients) -> Real:
    first = {"B": orders.nk}
    return np.array(
        [
            found[kind, j][lag - (int(first[kind][j]) if kind in first else 1)]
            for kind, j, lag in orders.owners()
        ]
    )


def _long_orders(problem: RowProblem) -> list[int]:
    rows = sum(map(len, problem.outputs))
    channels = problem.inputs[0].shape[1] + 1
    least = problem.orders.memory + 1
    wanted = sorted({max(n, least) for n in LONG_ORDERS})
    return [n for n in wanted if n * channels <= rows // 4] or [least]


def _plants(problem: RowProblem) -> Iterator[Coefficients]:
    orders = problem.orders
    for length in _long_orders(problem):
        if not orders.nf.any():
            yield _regressed(problem, _long_errors(problem, length))
            continue
        theta = _long_arx(problem, length)
        parts = [_from_long(problem, theta, length)]
        if len(orders.nb) == 1:
            parts.append(_from_filtered(problem, np.r_[1.0, theta[:length]]))
        yield from (_plant(orders, part) for part in parts if part is not None)
    if len(orders.nb) == 1 and orders.nf.any():
        part = _from_filtered(problem, np.ones(1))
        if part is not None:
            yield _plant(orders, part)


def _own(problem: RowProblem) -> list[Real]:
    return [y[:, problem.orders.output] for y in problem.outputs]


def _plant(orders: RowOrders, parts: list[Real]) -> Coefficients:
    """Return A = 1 and the B and F of output-error parameters by input."""
    out: Coefficients = {("A", j): np.zeros(n) for j, n in enumerate(orders.na)}
    for j, theta in enumerate(parts):
        out["B", j], out["F", j] = theta[: orders.nb[j]], theta[orders.nb[j] :]
    return out


def _long_errors(problem: RowProblem, length: int) -> list[Real]:
    """Return the errors of an ARX model of own output and inputs, zero before ``length``."""
    theta = _long_arx(problem, length)
    out = []
    for u, y in zip(problem.inputs, _own(problem), strict=True):
        e = y - _long_columns(u, y, length) @ theta
        e[:length] = 0.0
        out.append(e)
    return out


def _long_columns(u: Real, y: Real, length: int) -> Real:
    columns = [-delayed(y, k, len(y)) for k in range(1, length + 1)]
    columns += [delayed(x, k, len(y)) for x in u.T for k in range(length + 1)]
    return np.stack(columns, axis=1)


def _long_arx(problem: RowProblem, length: int) -> Real:
    pairs = list(zip(problem.inputs, _own(problem), strict=True))
    return least_squares(
        np.concatenate([_long_columns(u, y, length)[length:] for u, y in pairs]),
        np.concatenate([y[length:] for _, y in pairs]),
    )


def _from_filtered(problem: RowProblem, whitening: Real) -> list[Real] | None:
    """Return B and F of one input by refits to data that a filter makes white."""
    orders = problem.orders

    def filtered(x: Real) -> Real:
        return np.asarray(signal.lfilter(whitening, [1.0], x, axis=0))

    own = OutputErrorProblem(
        orders.nb,
        orders.nf,
        orders.nk,
        [filtered(u) for u in problem.inputs],
        [filtered(y) for y in _own(problem)],
        len(whitening) - 1,
    )
    theta = refitted(own)
    return None if theta is None else [theta]


def _from_long(problem: RowProblem, theta: Real, length: int) -> list[Real] | None:
    """Return B and F by input that come nearest to a long ARX model, as the prediction errors weigh it.

    The distance of B/F from the long B_L / A_L with the noise model 1 / A_L is that of B/F (A_L u) from
    B_L u (Zhu, 2001, asymptotic method).
    """
    orders = problem.orders
    whitening = np.r_[1.0, theta[:length]]
    parts = []
    for j in range(len(orders.nb)):
        top = theta[length + j * (length + 1) : length + (j + 1) * (length + 1)]
        one = slice(j, j + 1)
        inputs = [signal.lfilter(whitening, [1.0], u[:, one], axis=0) for u in problem.inputs]
        outputs = [signal.lfilter(top, [1.0], u[:, j]) for u in problem.inputs]
        part = refitted(
            OutputErrorProblem(
                orders.nb[one], orders.nf[one], orders.nk[one], inputs, outputs, length
            )
        )
        if part is None:
            return None
        parts.append(part)
    return parts


def _regressed(problem: RowProblem, errors: list[Real]) -> Coefficients:
    """Return A and B by regression on past outputs, inputs and, for C and D, past errors."""
    orders = problem.orders
    past = max(orders.nc, orders.nd)
    blocks, targets = [], []
    lead = orders.memory
    for u, y, e in zip(problem.inputs, problem.outputs, errors, strict=True):
        base = {"A": -y, "B": u}
        columns = [
            delayed(base[kind][:, j], lag, len(y))
            for kind, j, lag in orders.owners()
            if kind in base
        ]
        columns += [delayed(e, lag, len(y)) for lag in range(1, past + 1)]
        blocks.append(np.stack(columns, axis=1)[lead:])
        targets.append(y[lead:, orders.output])
    theta = least_squares(np.concatenate(blocks), np.concatenate(targets))
    out: Coefficients = {("F", j): np.zeros(0) for j in range(len(orders.nf))}
    place = 0
    for kind, counts in (("A", orders.na), ("B", orders.nb)):
        for j, n in enumerate(counts):
            out[kind, j] = theta[place : place + n]
            place += int(n)
    return out


def _noises(problem: RowProblem, plant: Coefficients) -> Iterator[Coefficients]:
    """Yield C and D: ones, and those of an ARMA model of what the plant leaves."""
    orders = problem.orders
    i = orders.output
    flat: Coefficients = {("C", i): np.zeros(orders.nc), ("D", i): np.zeros(orders.nd)}
    yield flat
    if orders.nc + orders.nd == 0:
        return
    bare = RowProblem(
        RowOrders(i, orders.na, orders.nb, orders.nf, orders.nk, 0, 0),
        problem.inputs,
        problem.outputs,
        problem.transients,
    )
    left = bare.residual(_vector(bare.orders, plant))
    if np.isfinite(left).all():
        parts = np.split(left, np.cumsum([len(y) for y in problem.outputs])[:-1])
        yield _arma(orders, parts)


def _arma(orders: RowOrders, parts: list[Real]) -> Coefficients:
    """Return D v = C e by regression on past v and the errors of a long AR model."""
    nc, nd = orders.nc, orders.nd
    rows = sum(map(len, parts))
    length = int(min(max(30, 2 * (nc + nd)), rows // 8))

    def lagged(v: Real, most: int) -> list[Real]:
        return [delayed(v, k, len(v)) for k in range(1, most + 1)]

    long = np.concatenate([np.stack(lagged(v, length), axis=1)[length:] for v in parts])
    theta = least_squares(long, np.concatenate([v[length:] for v in parts]))
    blocks = []
    for v in parts:
        e = np.asarray(signal.lfilter(np.r_[1.0, -theta], [1.0], v))
        e[:length] = 0.0
        columns = [-x for x in lagged(v, nd)] + lagged(e, nc)
        blocks.append(np.stack(columns, axis=1)[2 * length :])
    found = least_squares(np.concatenate(blocks), np.concatenate([v[2 * length :] for v in parts]))
    top = stabilized(np.r_[1.0, found[nd:]])
    return {("D", orders.output): found[:nd], ("C", orders.output): top[1:]}
