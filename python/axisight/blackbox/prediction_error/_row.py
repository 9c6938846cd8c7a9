"""The prediction errors of one output of (3.21), and their exact derivatives.

    A_i(q) y(t) = sum_j B_j(q) / F_j(q) u_j(t) + C(q) / D(q) e(t)

A_i is a row of polynomials, one for every output. With v = A_i y - sum_j w_j and w_j = B_j / F_j u_j
the prediction error is e = D / C v. Its derivatives are filtered signals (Ljung, 1999, section 10.3):

    a: D/C q^-l y    b: -D/(C F) q^-l u    f: D/(C F) q^-l w    c: -1/C q^-l e    d: 1/C q^-l v

What happened before the first sample adds a transient P(q) / (C prod F) delta(t) to the errors, with
free coefficients of P. They enter linearly, so every evaluation solves for them (variable projection,
Kaufman, 1975); the gradient of the loss stays exact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from axisight.blackbox._data import Integers, Real
from axisight.blackbox._output_error_problem import delayed


@dataclass(frozen=True)
class RowOrders:
    """Orders of one output's equation: ``na`` (n_out,), ``nb``, ``nf``, ``nk`` (n_in,), ``nc``, ``nd``."""

    output: int
    na: Integers
    nb: Integers
    nf: Integers
    nk: Integers
    nc: int
    nd: int

    @property
    def n_parameters(self) -> int:
        """Number of coefficients."""
        return int(self.na.sum() + self.nb.sum() + self.nf.sum() + self.nc + self.nd)

    @property
    def memory(self) -> int:
        """Samples of the past on which a prediction error depends, beyond the poles of C and F."""
        above = [int(self.na.max(initial=0)) + int(self.nf.sum())]
        for j in np.flatnonzero(self.nb):
            others = int(self.nf.sum() - self.nf[j])
            above.append(int(self.nk[j] + self.nb[j] - 1) + others)
        return max(self.nc + int(self.nf.sum()), self.nd + max(above))

    def owners(self) -> Iterator[tuple[str, int, int]]:
        """Yield polynomial, channel (from 0) and lag of every coefficient, in their order."""
        for j, n in enumerate(self.na):
            yield from (("A", j, lag) for lag in range(1, n + 1))
        for j, n in enumerate(self.nb):
            yield from (("B", j, int(self.nk[j]) + k) for k in range(n))
            yield from (("F", j, lag) for lag in range(1, self.nf[j] + 1))
        yield from (("C", self.output, lag) for lag in range(1, self.nc + 1))
        yield from (("D", self.output, lag) for lag in range(1, self.nd + 1))


@dataclass(frozen=True)
class RowPolynomials:
    """Polynomials in q^-1 of one output: ``a`` by output, ``b`` and ``f`` by input, ``c``, ``d``."""

    a: list[Real]
    b: list[Real]
    f: list[Real]
    c: Real
    d: Real

    @property
    def stable(self) -> bool:
        """Whether the predictor is stable: all roots of C and of every F inside the unit circle."""
        return all(np.all(np.abs(np.roots(p)) < 1) for p in (self.c, *self.f))


def polynomials(orders: RowOrders, theta: Real) -> RowPolynomials:
    """Return the polynomials of a parameter vector."""
    a = [np.zeros(n + 1) for n in orders.na]
    a[orders.output][0] = 1.0
    b = [np.zeros(max(int(k + n), 1)) for k, n in zip(orders.nk, orders.nb, strict=True)]
    f = [np.r_[1.0, np.zeros(n)] for n in orders.nf]
    c, d = np.r_[1.0, np.zeros(orders.nc)], np.r_[1.0, np.zeros(orders.nd)]
    places = {"A": a, "B": b, "F": f}
    for value, (kind, channel, lag) in zip(theta, orders.owners(), strict=True):
        target = c if kind == "C" else d if kind == "D" else places[kind][channel]
        target[lag] = value
    return RowPolynomials(a, b, f, c, d)


@dataclass(frozen=True)
class _Signals:
    """Signals of one experiment at one parameter vector."""

    w: list[Real]
    v: Real
    errors: Real
    transient: Real
    basis: Real


@dataclass(frozen=True)
class RowProblem:
    """Prediction errors of one output over several experiments.

    ``inputs`` (n, n_in) and ``outputs`` (n, n_out) by experiment. ``transients`` says whether the past
    of every experiment is estimated; otherwise all signals were zero.
    """

    orders: RowOrders
    inputs: list[Real]
    outputs: list[Real]
    transients: bool

    @property
    def n_rows(self) -> int:
        """Samples less those that the unknown pasts take up."""
        lost = self.orders.memory if self.transients else 0
        return sum(max(len(y) - lost, 0) for y in self.outputs)

    def residual(self, theta: Real) -> Real:
        """Return the prediction errors of all experiments, NaN where the predictor is unstable."""
        p = polynomials(self.orders, theta)
        if not p.stable:
            return np.full(sum(map(len, self.outputs)), np.nan)
        pairs = zip(self.inputs, self.outputs, strict=True)
        return np.concatenate([self._signals(p, u, y).errors for u, y in pairs])

    def loss(self, theta: Real) -> float:
        """Return the sum of squared prediction errors, infinite where the predictor is unstable."""
        value = float(np.sum(self.residual(theta) ** 2))
        return value if np.isfinite(value) else np.inf

    def jacobian(self, theta: Real) -> Real:
        """Return the derivative of `residual`, (samples, parameters), free of the transients."""
        p = polynomials(self.orders, theta)
        blocks = []
        for u, y in zip(self.inputs, self.outputs, strict=True):
            s = self._signals(p, u, y)
            slope = self._slopes(p, s, u, y)
            blocks.append(slope - s.basis @ (s.basis.T @ slope))
        return np.concatenate(blocks)

    def _signals(self, p: RowPolynomials, u: Real, y: Real) -> _Signals:
        w = [_filter(b, f, u[:, j]) for j, (b, f) in enumerate(zip(p.b, p.f, strict=True))]
        v = sum((_filter(a, np.ones(1), y[:, j]) for j, a in enumerate(p.a)), np.zeros(len(y)))
        v = v - sum(w, np.zeros(len(y)))
        raw = _filter(p.d, p.c, v)
        basis = self._transients(p, len(y))
        part = basis @ (basis.T @ raw)
        return _Signals(w, v, raw - part, -part, basis)

    def _transients(self, p: RowPolynomials, n: int) -> Real:
        """Return an orthonormal basis (n, memory) of what the past may add."""
        count = min(self.orders.memory, n) if self.transients else 0
        if not count:
            return np.zeros((n, 0))
        pulse = np.zeros(n)
        pulse[0] = 1.0
        for bottom in (p.c, *p.f):
            pulse = _filter(np.ones(1), bottom, pulse)
        columns = np.stack([delayed(pulse, k, n) for k in range(count)], axis=1)
        return np.asarray(linalg.qr(columns, mode="economic", check_finite=False)[0])

    def _slopes(self, p: RowPolynomials, s: _Signals, u: Real, y: Real) -> Real:
        n = len(y)
        one = np.ones(1)
        base: dict[tuple[str, int], Real] = {
            ("C", self.orders.output): -_filter(one, p.c, s.errors),
            ("D", self.orders.output): _filter(one, p.c, s.v),
        }
        for j in np.flatnonzero(self.orders.na):
            base["A", int(j)] = _filter(p.d, p.c, y[:, j])
        for j in np.flatnonzero(self.orders.nb):
            through = _filter(one, p.f[j], _filter(p.d, p.c, u[:, j]))
            base["B", int(j)] = -through
            base["F", int(j)] = _filter(p.b[j], p.f[j], through) - _filter(one, p.f[j], s.transient)
        columns = [delayed(base[kind, j], lag, n) for kind, j, lag in self.orders.owners()]
        return np.stack(columns, axis=1) if columns else np.zeros((n, 0))


def _filter(top: Real, bottom: Real, x: Real) -> Real:
    return np.asarray(signal.lfilter(top, bottom, x), np.float64)
