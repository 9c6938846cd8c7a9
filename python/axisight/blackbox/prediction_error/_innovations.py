"""Prediction errors of a model in innovations form, and their exact derivatives.

The predictor (3.33) is x(t+1) = (A - K C) x + (B - K D) u + K y, with the error e = y - C x - D u. A
change of a matrix drives the predictor with one of x, u and e, so every derivative is a combination
of its responses to these signals at each state. The unknown first state of every experiment enters
linearly, and every evaluation solves for it (variable projection, Kaufman, 1975).

Similar models have equal errors. The search therefore moves in the directions that change the model:
the orthogonal complement of d(A, B, C, K) = (T A - A T, T B, -C T, T K) (data-driven local
coordinates: McKelvey, Helmersson and Ribarits, 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from axisight.blackbox._data import Real
from axisight.statistics.recursion import states

LEAST_STATE = 1e-10
"""Directions of the state with less than this share of the largest Gramian are not rescaled."""


@dataclass(frozen=True)
class Matrices:
    """A (n, n), B (n, m), C (p, n), D (p, m) and K (n, p)."""

    a: Real
    b: Real
    c: Real
    d: Real
    k: Real

    @property
    def predictor(self) -> Real:
        """A - K C."""
        return np.asarray(self.a - self.k @ self.c)

    @property
    def stable_predictor(self) -> bool:
        """Whether all eigenvalues of A - K C are inside the unit circle."""
        return bool(np.all(np.abs(np.linalg.eigvals(self.predictor)) < 1))

    def transformed(self, t: Real) -> Matrices:
        """Return the same model with states ``T x``."""
        back = np.linalg.inv(t)
        return Matrices(t @ self.a @ back, t @ self.b, self.c @ back, self.d, t @ self.k)

    def balanced(self) -> Matrices:
        """Return the same model with equal Gramians of its predictor, if they are regular."""
        transition = self.predictor
        drive = np.hstack([self.b - self.k @ self.d, self.k])
        reach = linalg.solve_discrete_lyapunov(transition, drive @ drive.T)
        see = linalg.solve_discrete_lyapunov(transition.T, self.c.T @ self.c)
        values, vectors = np.linalg.eigh((reach + reach.T) / 2)
        if values[0] <= LEAST_STATE * values[-1]:
            return self
        root = vectors * np.sqrt(values)
        size, turned = np.linalg.eigh(root.T @ see @ root)
        if size[0] <= LEAST_STATE**2 * size[-1]:
            return self
        return self.transformed(np.linalg.inv(root @ turned * size**-0.25))


@dataclass(frozen=True)
class Layout:
    """Which matrices are free, and their place in the parameter vector."""

    n: int
    m: int
    p: int
    direct: bool
    noise: bool

    @property
    def shapes(self) -> dict[str, tuple[int, int]]:
        """Shapes of the free matrices in their order."""
        n, m, p = self.n, self.m, self.p
        out = {"a": (n, n), "b": (n, m), "c": (p, n)}
        if self.direct:
            out["d"] = (p, m)
        if self.noise:
            out["k"] = (n, p)
        return out

    def vector(self, x: Matrices) -> Real:
        """Return the free matrices as one vector."""
        return np.concatenate([getattr(x, name).ravel() for name in self.shapes])

    def matrices(self, theta: Real) -> Matrices:
        """Return the matrices of a vector; those that are not free are zero."""
        found = {"d": np.zeros((self.p, self.m)), "k": np.zeros((self.n, self.p))}
        place = 0
        for name, shape in self.shapes.items():
            size = shape[0] * shape[1]
            found[name] = theta[place : place + size].reshape(shape)
            place += size
        return Matrices(**found)

    def directions(self, x: Matrices) -> Real:
        """Return an orthonormal basis (parameters, free directions) of what changes the model."""
        n = self.n
        tangent = []
        for i in range(n):
            for j in range(n):
                t = np.zeros((n, n))
                t[i, j] = 1.0
                change = Matrices(t @ x.a - x.a @ t, t @ x.b, -x.c @ t, np.zeros_like(x.d), t @ x.k)
                tangent.append(self.vector(change))
        q, _ = np.linalg.qr(np.stack(tangent, axis=1), mode="complete")
        return np.asarray(q[:, n * n :])


@dataclass(frozen=True)
class InnovationsProblem:
    """Weighted prediction errors over several experiments.

    ``inputs`` (n, m), ``outputs`` (n, p) by experiment; ``weight`` (p, p) multiplies the errors from
    the left. ``transients`` says whether every first state is estimated; otherwise it is zero.
    """

    layout: Layout
    inputs: list[Real]
    outputs: list[Real]
    weight: Real
    transients: bool

    @property
    def n_values(self) -> int:
        """Measured values less those that unknown first states take up."""
        lost = self.layout.n if self.transients else 0
        return sum(max(y.size - lost, 0) for y in self.outputs)

    def residual(self, theta: Real) -> Real:
        """Return the weighted errors as one vector, NaN where the predictor is unstable."""
        x = self.layout.matrices(theta)
        if not x.stable_predictor:
            return np.full(sum(y.size for y in self.outputs), np.nan)
        return np.concatenate([(e @ self.weight.T).ravel() for e in self.errors(x)])

    def errors(self, x: Matrices) -> list[Real]:
        """Return the errors (n, p) of every experiment, not weighted."""
        return [self._motion(x, u, y)[1] for u, y in zip(self.inputs, self.outputs, strict=True)]

    def jacobian(self, theta: Real) -> Real:
        """Return the derivative of `residual`, (values, parameters), free of first states."""
        x = self.layout.matrices(theta)
        blocks = []
        for u, y in zip(self.inputs, self.outputs, strict=True):
            state, e, basis = self._motion(x, u, y)
            slope = np.einsum("ij,tjk->tik", self.weight, self._slopes(x, state, u, e))
            slope = slope.reshape(-1, len(theta))
            blocks.append(slope - basis @ (basis.T @ slope))
        return np.concatenate(blocks)

    def _motion(self, x: Matrices, u: Real, y: Real) -> tuple[Real, Real, Real]:
        """Return states (n, n_states), errors (n, p), and the basis of weighted transients."""
        n, p = self.layout.n, self.layout.p
        free = n if self.transients else 0
        drive = np.zeros((len(u), n, 1 + free))
        drive[:, :, 0] = u @ (x.b - x.k @ x.d).T + y @ x.k.T
        found = states(x.predictor, drive, np.eye(n, 1 + free, k=1))[:-1]
        state = found[:, :, 0]
        e = y - state @ x.c.T - u @ x.d.T
        if not free:
            return state, e, np.zeros((len(u) * p, 0))
        seen = np.einsum("ij,tjk->tik", self.weight @ x.c, found[:, :, 1:]).reshape(-1, n)
        q, r = linalg.qr(seen, mode="economic", check_finite=False)
        first = np.linalg.lstsq(r, q.T @ (e @ self.weight.T).ravel(), rcond=1e-12)[0]
        start = found[:, :, 1:] @ first
        return state + start, e - start @ x.c.T, q

    def _slopes(self, x: Matrices, state: Real, u: Real, e: Real) -> Real:
        """Return the derivatives (n, p, parameters) of the errors for fixed first states."""
        p = self.layout.p
        by_state = [self._responses(x, s) for s in state.T]
        by_input = [self._responses(x, s) for s in u.T]
        unit = np.eye(p)
        columns = {
            # Entry (r, j) of A drives state r with state j.
            "a": -np.stack(by_state, axis=3),
            "b": -np.stack(by_input, axis=3),
            "c": self._seen(by_state, x.k) - state[:, None, None, :] * unit[:, :, None],
        }
        if self.layout.direct:
            columns["d"] = self._seen(by_input, x.k) - u[:, None, None, :] * unit[:, :, None]
        if self.layout.noise:
            columns["k"] = -np.stack([self._responses(x, s) for s in e.T], axis=3)
        return np.concatenate(
            [columns[name].reshape(len(u), p, -1) for name in self.layout.shapes], axis=2
        )

    def _responses(self, x: Matrices, s: Real) -> Real:
        """Return C times the predictor's response (n, p, n_states) to a signal at each state."""
        n = self.layout.n
        drive = s[:, None, None] * np.eye(n)
        found = states(x.predictor, drive, np.zeros((n, n)))[:-1]
        return np.asarray(np.einsum("ij,tjr->tir", x.c, found), np.float64)

    @staticmethod
    def _seen(responses: list[Real], k: Real) -> Real:
        """Return the responses (n, p, p, signals) to signals that enter through -K, negated."""
        return np.stack([np.einsum("tir,rl->til", r, k) for r in responses], axis=3)
