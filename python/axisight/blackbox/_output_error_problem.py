"""The search problem of an output-error model of one output, and where its search starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from axisight.blackbox._data import Integers, Real
from axisight.errors import InputError
from axisight.statistics.least_squares import scaled_solution

START_ROUNDS = 20
"""Refits of the start; more do not improve it."""

LONG_ORDERS = (30, 60)
"""Further ARX orders to start from if there are several inputs. Only a long ARX model comes near white
noise on the output."""

EXACT = 1e-12
"""Singular values below this share of the largest are rounding."""

PULSE_SAMPLES = 4000
"""Samples of the pulse responses to start from if there are several inputs."""


@dataclass(frozen=True)
class OutputErrorProblem:
    """The problem of one output: orders by input, experiments, and samples left out of each."""

    nb: Integers
    nf: Integers
    nk: Integers
    inputs: list[Real]
    outputs: list[Real]
    skip: int

    @property
    def n_inputs(self) -> int:
        return len(self.nb)

    def split(self, theta: Real) -> tuple[list[Real], list[Real]]:
        """Return polynomials B with delays, and F with leading one."""
        b, f, place = [], [], 0
        for j in range(self.n_inputs):
            b.append(np.concatenate([np.zeros(self.nk[j]), theta[place : place + self.nb[j]]]))
            place += int(self.nb[j])
            f.append(np.concatenate([[1.0], theta[place : place + self.nf[j]]]))
            place += int(self.nf[j])
        return b, f

    def stable(self, theta: Real) -> bool:
        return all(np.all(np.abs(np.roots(f)) < 1) for f in self.split(theta)[1])

    def residual(self, theta: Real) -> Real:
        """Return model minus measurement, NaN where F is unstable."""
        rows = sum(len(y) - self.skip for y in self.outputs)
        if not self.stable(theta):
            return np.full(rows, np.nan)
        b, f = self.split(theta)
        out = []
        for u, y in zip(self.inputs, self.outputs, strict=True):
            model = sum(signal.lfilter(b[j], f[j], u[:, j]) for j in range(self.n_inputs))
            out.append((model - y)[self.skip :])
        return np.concatenate(out)

    def jacobian(self, theta: Real) -> Real:
        """Return the exact derivative of `residual`."""
        b, f = self.split(theta)
        out = []
        for u in self.inputs:
            n, columns = len(u), []
            for j in range(self.n_inputs):
                w = signal.lfilter([1.0], f[j], u[:, j])
                s = signal.lfilter(b[j], f[j], w)
                columns += [delayed(w, int(self.nk[j]) + k, n) for k in range(self.nb[j])]
                columns += [-delayed(s, k + 1, n) for k in range(self.nf[j])]
            out.append(np.stack(columns, axis=1)[self.skip :])
        return np.concatenate(out)


def start_of(problem: OutputErrorProblem, output: int) -> Real:
    """Return the stable start of least loss: from refits, or from pulse responses for several inputs."""
    candidates = []
    if problem.n_inputs == 1:
        candidates.append([refitted(problem)])
    else:
        rows = sum(len(y) - problem.skip for y in problem.outputs)
        least = int(problem.nf.sum())
        for order in sorted({least, 2 * least + 2, *LONG_ORDERS}):
            if least <= order <= rows // (4 * (problem.n_inputs + 1)):
                candidates.append([refitted(part) for part in pulse_problems(problem, order)])
    best: tuple[float, Real] | None = None
    for parts in candidates:
        if all(part is not None for part in parts):
            theta = np.concatenate([part for part in parts if part is not None])
            loss = float(np.sum(problem.residual(theta) ** 2))
            if np.isfinite(loss) and (best is None or loss < best[0]):
                best = loss, theta
    if best is None:
        raise InputError(
            f"experiments: output {output + 1} has no stable output-error model of this order to "
            "start from: it may integrate (fit its velocity), be unstable, or too short"
        )
    return best[1]


def refitted(problem: OutputErrorProblem) -> Real | None:
    """Return the best of an ARX model and its refits to filtered data, for one input."""
    best: tuple[float, Real] | None = None
    bottom = np.ones(1)
    for _ in range(START_ROUNDS):
        x, y = (_filtered(s, bottom) for s in ([u[:, 0] for u in problem.inputs], problem.outputs))
        theta = _equation_error(problem, x, y)
        b, f = problem.split(theta)
        following = stabilized(f[0])
        theta = np.concatenate([b[0][problem.nk[0] :], following[1:]])
        loss = float(np.sum(problem.residual(theta) ** 2))
        if np.isfinite(loss) and (best is None or loss < best[0]):
            best = loss, theta
        if len(bottom) == len(following) and np.allclose(bottom, following, rtol=0, atol=1e-9):
            break
        bottom = following
    return None if best is None else best[1]


def _filtered(signals: list[Real], bottom: Real) -> list[Real]:
    return [np.asarray(signal.lfilter([1.0], bottom, x)) for x in signals]


def _equation_error(problem: OutputErrorProblem, inputs: list[Real], outputs: list[Real]) -> Real:
    """Return the least-squares solution of F y = B u for one input."""
    nb, nf, nk = int(problem.nb[0]), int(problem.nf[0]), int(problem.nk[0])
    rows = []
    for x, y in zip(inputs, outputs, strict=True):
        columns = [delayed(x, nk + k, len(x)) for k in range(nb)]
        columns += [-delayed(y, k + 1, len(x)) for k in range(nf)]
        rows.append(np.stack(columns, axis=1)[problem.skip :])
    return least_squares(np.concatenate(rows), np.concatenate([y[problem.skip :] for y in outputs]))


def least_squares(matrix: Real, target: Real) -> Real:
    """Return the least-squares solution x (n,) of ``matrix x = target``, (m, n) and (m,)."""
    # The triangle has the singular values of the tall matrix, at a tenth of the cost.
    (r,) = linalg.qr(np.column_stack([matrix, target]), mode="r", check_finite=False)
    width = matrix.shape[1]
    triangle = np.asarray(r[: width + 1], np.float64)
    return scaled_solution(triangle[:, :width], triangle[:, width], EXACT)


def pulse_problems(problem: OutputErrorProblem, order: int) -> list[OutputErrorProblem]:
    """Return one problem per input, whose data are the pulse response of an ARX model of ``order``."""
    reach = int((problem.nk + problem.nb).max()) + order
    rows = []
    for u, y in zip(problem.inputs, problem.outputs, strict=True):
        columns = [-delayed(y, k + 1, len(y)) for k in range(order)]
        columns += [delayed(x, k, len(y)) for x in u.T for k in range(reach)]
        rows.append(np.stack(columns, axis=1)[problem.skip :])
    target = np.concatenate([y[problem.skip :] for y in problem.outputs])
    theta = least_squares(np.concatenate(rows), target)
    bottom = stabilized(np.concatenate([[1.0], theta[:order]]))
    length = min(PULSE_SAMPLES, max(len(y) for y in problem.outputs))
    pulse = np.zeros(length)
    pulse[0] = 1.0
    parts = []
    for j in range(problem.n_inputs):
        top = theta[order + j * reach : order + (j + 1) * reach]
        response = np.asarray(signal.lfilter(top, bottom, pulse))
        one = slice(j, j + 1)
        parts.append(
            OutputErrorProblem(
                problem.nb[one], problem.nf[one], problem.nk[one], [pulse[:, None]], [response], 0
            )
        )
    return parts


def stabilized(polynomial: Real) -> Real:
    """Return the polynomial with its roots beyond 0.999 reflected to within 0.999."""
    roots = np.roots(polynomial)
    size = np.abs(roots)
    far = size > 0.999
    if not far.any():
        return polynomial
    roots[far] /= np.maximum(size[far] ** 2, size[far] / 0.999)
    inside = np.real(np.atleast_1d(np.poly(roots)))
    return np.pad(inside, (0, len(polynomial) - len(inside)))


def delayed(x: Real, lag: int, n: int) -> Real:
    """Return the first ``n`` samples of x(t - lag), zero before its first."""
    out = np.zeros(n)
    if lag < n:
        out[lag:] = x[: n - lag]
    return out
