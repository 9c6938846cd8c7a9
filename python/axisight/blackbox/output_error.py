"""Output-error models, y_i(t) = sum_j B_ij(q) / F_ij(q) u_j(t) + e_i(t).

The case C = D = A = 1 of Wernholt (2004), (3.21): only the measurement is disturbed, and the
prediction is the simulation. Each output is a problem of its own. Its exact gradient comes from
two filters for each pair: with w = q^-l u / F and s = q^-l (B / F u) / F,

    d y / d b_l = w,   d y / d f_l = -s.

The start is the best of an ARX model and of Steiglitz and McBride's iteration, which refits that
model to data filtered by the last 1 / F. The trust-region search rejects steps that move a root of F
outside the unit circle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import linalg, optimize, signal

from axisight.blackbox._data import (
    Complex,
    Integers,
    Real,
    gathered,
    lines,
    order_matrix,
    parameter_table,
    response_variance,
    slowest_first,
    whole,
)
from axisight.blackbox._model import StateSpaceModel
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment
from axisight.statistics.least_squares import inverse_root, scaled_solution

START_ROUNDS = 20
"""Refits of the start; more do not improve it."""

LONG_ORDERS = (30, 60)
"""Further ARX orders to start from if there are several inputs. Only a long ARX model comes near white
noise on the output."""

EXACT = 1e-12
"""Singular values below this share of the largest are rounding."""

PULSE_SAMPLES = 4000
"""Samples of the pulse responses to start from if there are several inputs."""


@summarized
@dataclass(frozen=True)
class OutputErrorModel:
    """An output-error model with its uncertainty.

    ``b[i][j]`` and ``f[i][j]`` are the polynomials in q^-1 of output i and input j (from 0),
    delays included, f with leading one. ``names`` (``B12[1]``: output 1, input 2, lag 1),
    ``values`` and ``covariance`` run over all parameters. ``noise_variance`` (n_out,) is that of e.
    ``status`` is that of the worst output: ``converged``, ``max_evaluations`` or ``rank_deficient``
    (the data do not determine the parameters, and standard errors are NaN). ``warnings`` say what
    to do.
    """

    sample_time_s: float
    b: tuple[tuple[Real, ...], ...]
    f: tuple[tuple[Real, ...], ...]
    names: tuple[str, ...]
    values: Real
    covariance: Real = field(repr=False)
    noise_variance: Real
    status: str
    evaluations: int
    n_rows: int
    warnings: tuple[str, ...]
    owners: tuple[tuple[int, str, int, int], ...] = field(repr=False)
    """For each parameter: output, polynomial, input and lag, from 0."""

    @property
    def std(self) -> Real:
        """Standard errors of ``values``, for white measurement noise."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def poles(self) -> Complex:
        """Roots of every F, slowest (largest) first."""
        every = [np.roots(f) for row in self.f for f in row]
        return slowest_first(np.concatenate(every).astype(np.complex128))

    @property
    def stable(self) -> bool:
        """Always true: the search does not leave the stable models."""
        return bool(np.all(np.abs(self.poles) < 1))

    def parameters(self) -> xr.Dataset:
        """Return values and standard errors over ``parameter``."""
        return parameter_table(
            self.names, self.values, self.std, n_rows=self.n_rows, status=self.status
        )

    def simulate(self, experiment: Experiment) -> Real:
        """Return the output (n, n_out) for the input of ``experiment`` alone, from rest."""
        return self.to_state_space().simulate(experiment)

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return B / F at e^{iwT} and its variance, in the format of `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are
        labels. The variance follows from the covariance of the parameters to first order. Raises
        InputError for other frequencies.
        """
        hz = lines(frequency_hz, self.sample_time_s)
        z = np.exp(2j * np.pi * hz * self.sample_time_s)
        shape = (len(z), len(self.b), len(self.b[0]))
        g, bottom = np.empty(shape, np.complex128), np.empty(shape, np.complex128)
        for i, row in enumerate(self.b):
            for j, b in enumerate(row):
                bottom[:, i, j] = np.polyval(self.f[i][j][::-1], 1 / z)
                g[:, i, j] = np.polyval(b[::-1], 1 / z) / bottom[:, i, j]
        slope = np.zeros((*shape, len(self.values)), np.complex128)
        for k, (i, kind, j, lag) in enumerate(self.owners):
            top = 1.0 if kind == "B" else -g[:, i, j]
            slope[:, i, j, k] = top * z ** (-lag) / bottom[:, i, j]
        return frequency_response(
            hz,
            g,
            estimator="output_error",
            variance=response_variance(slope, self.covariance),
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"n_rows": self.n_rows, "status": self.status},
        )

    def to_state_space(self) -> StateSpaceModel:
        """Return the same model in state space, every pair with states of its own."""
        n_out, n_in = len(self.b), len(self.b[0])
        parts: list[tuple[Real, Real, Real]] = []
        direct = np.zeros((n_out, n_in))
        for i in range(n_out):
            for j in range(n_in):
                top, bottom = self.b[i][j], self.f[i][j]
                n = max(len(top), len(bottom)) - 1
                top, bottom = (np.pad(x, (0, n + 1 - len(x))) for x in (top, bottom))
                direct[i, j] = top[0]
                drive, seen = np.zeros((n, n_in)), np.zeros((n_out, n))
                transition = np.eye(n, k=1)
                if n:
                    transition[:, 0] -= bottom[1:]
                    drive[:, j] = top[1:] - bottom[1:] * top[0]
                    seen[i, 0] = 1.0
                parts.append((transition, drive, seen))
        return StateSpaceModel(
            self.sample_time_s,
            linalg.block_diag(*(a for a, _, _ in parts)),
            np.vstack([b for _, b, _ in parts]),
            np.hstack([c for _, _, c in parts]),
            direct,
            np.zeros((sum(len(a) for a, _, _ in parts), n_out)),
            np.diag(self.noise_variance),
        )


@dataclass(frozen=True)
class _Problem:
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
                columns += [_delayed(w, int(self.nk[j]) + k, n) for k in range(self.nb[j])]
                columns += [-_delayed(s, k + 1, n) for k in range(self.nf[j])]
            out.append(np.stack(columns, axis=1)[self.skip :])
        return np.concatenate(out)


def output_error(
    experiments: Experiment | Sequence[Experiment],
    *,
    nf: ArrayLike,
    nb: ArrayLike,
    nk: ArrayLike = 1,
    skip: int = 0,
    max_evaluations: int = 200,
) -> OutputErrorModel:
    """Return the output-error model of one or several experiments.

    experiments
        `axisight.records.experiment.Experiment`, all with the same sample time and channels. Each
        starts at rest; subtract offsets first.
    nf
        Order of F, one number or (n_out, n_in).
    nb, nk
        Number of coefficients of B and the lag of the first, one number or (n_out, n_in).
    skip
        Samples at the start of each experiment that are not compared, for experiments that do not
        start at rest.
    max_evaluations
        Most evaluations of the search, for each output.

    Standard errors hold for white measurement noise. With coloured noise in open loop the estimate
    stays consistent, but the standard errors are wrong (`axisight.blackbox.residual_tests`). In closed
    loop output-error models are biased unless the noise is white or small.

    Raises InputError for misuse, for experiments that are too short, and for outputs without a stable
    model to start from; non-convergence is a status. An integrating or unstable plant has no
    output-error model: fit its velocity, or use ``arx`` or ``state_space``.
    """
    data = gathered(experiments, "experiments")
    p, m = data[0].output.shape[1], data[0].input.shape[1]
    orders_f = order_matrix("nf", nf, (p, m), 0)
    orders_b = order_matrix("nb", nb, (p, m), 1)
    delays = order_matrix("nk", nk, (p, m), 0)
    left_out = whole("skip", skip, 0)
    limit = whole("max_evaluations", max_evaluations, 1)
    most = int((orders_f + orders_b).sum(axis=1).max())
    reach = int((orders_f.max() + orders_b + delays).max())
    rows = sum(e.n_samples - left_out for e in data)
    if rows <= most or min(e.n_samples for e in data) <= max(left_out, reach):
        raise InputError(
            f"experiments: expected more than {max(left_out, reach)} samples in each and more than "
            f"{most} to compare, got {rows}"
        )
    found = []
    for i in range(p):
        problem = _Problem(
            orders_b[i],
            orders_f[i],
            delays[i],
            [e.input for e in data],
            [e.output[:, i] for e in data],
            left_out,
        )
        found.append((problem, *_searched(problem, limit, i)))
    return _model(found, data[0].sample_time_s, rows)


def _searched(problem: _Problem, limit: int, output: int) -> tuple[Real, str, int]:
    start = _start(problem, output)
    result = optimize.least_squares(
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
    status = "max_evaluations" if result.status == 0 else "converged"
    return np.asarray(result.x), status, int(result.nfev)


def _start(problem: _Problem, output: int) -> Real:
    """Return the stable start of least loss: from refits, or from pulse responses for several inputs."""
    candidates = []
    if problem.n_inputs == 1:
        candidates.append([_refitted(problem)])
    else:
        rows = sum(len(y) - problem.skip for y in problem.outputs)
        least = int(problem.nf.sum())
        for order in sorted({least, 2 * least + 2, *LONG_ORDERS}):
            if least <= order <= rows // (4 * (problem.n_inputs + 1)):
                candidates.append([_refitted(part) for part in _pulses(problem, order)])
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


def _refitted(problem: _Problem) -> Real | None:
    """Return the best of an ARX model and its refits to filtered data, for one input."""
    best: tuple[float, Real] | None = None
    bottom = np.ones(1)
    for _ in range(START_ROUNDS):
        x, y = (_filtered(s, bottom) for s in ([u[:, 0] for u in problem.inputs], problem.outputs))
        theta = _equation_error(problem, x, y)
        b, f = problem.split(theta)
        following = _stabilized(f[0])
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


def _equation_error(problem: _Problem, inputs: list[Real], outputs: list[Real]) -> Real:
    """Return the least-squares solution of F y = B u for one input."""
    nb, nf, nk = int(problem.nb[0]), int(problem.nf[0]), int(problem.nk[0])
    rows = []
    for x, y in zip(inputs, outputs, strict=True):
        columns = [_delayed(x, nk + k, len(x)) for k in range(nb)]
        columns += [-_delayed(y, k + 1, len(x)) for k in range(nf)]
        rows.append(np.stack(columns, axis=1)[problem.skip :])
    return _least_squares(
        np.concatenate(rows), np.concatenate([y[problem.skip :] for y in outputs])
    )


def _least_squares(matrix: Real, target: Real) -> Real:
    # The triangle has the singular values of the tall matrix, at a tenth of the cost.
    (r,) = linalg.qr(np.column_stack([matrix, target]), mode="r", check_finite=False)
    width = matrix.shape[1]
    triangle = np.asarray(r[: width + 1], np.float64)
    return scaled_solution(triangle[:, :width], triangle[:, width], EXACT)


def _pulses(problem: _Problem, order: int) -> list[_Problem]:
    """Return one problem per input, whose data are the pulse response of an ARX model of ``order``."""
    reach = int((problem.nk + problem.nb).max()) + order
    rows = []
    for u, y in zip(problem.inputs, problem.outputs, strict=True):
        columns = [-_delayed(y, k + 1, len(y)) for k in range(order)]
        columns += [_delayed(x, k, len(y)) for x in u.T for k in range(reach)]
        rows.append(np.stack(columns, axis=1)[problem.skip :])
    target = np.concatenate([y[problem.skip :] for y in problem.outputs])
    theta = _least_squares(np.concatenate(rows), target)
    bottom = _stabilized(np.concatenate([[1.0], theta[:order]]))
    length = min(PULSE_SAMPLES, max(len(y) for y in problem.outputs))
    pulse = np.zeros(length)
    pulse[0] = 1.0
    parts = []
    for j in range(problem.n_inputs):
        top = theta[order + j * reach : order + (j + 1) * reach]
        response = np.asarray(signal.lfilter(top, bottom, pulse))
        one = slice(j, j + 1)
        parts.append(
            _Problem(
                problem.nb[one], problem.nf[one], problem.nk[one], [pulse[:, None]], [response], 0
            )
        )
    return parts


def _stabilized(polynomial: Real) -> Real:
    """Return the polynomial with its roots beyond 0.999 reflected to within 0.999."""
    roots = np.roots(polynomial)
    size = np.abs(roots)
    far = size > 0.999
    if not far.any():
        return polynomial
    roots[far] /= np.maximum(size[far] ** 2, size[far] / 0.999)
    inside = np.real(np.atleast_1d(np.poly(roots)))
    return np.pad(inside, (0, len(polynomial) - len(inside)))


def _model(
    found: list[tuple[_Problem, Real, str, int]], sample_time_s: float, rows: int
) -> OutputErrorModel:
    names: list[str] = []
    owners: list[tuple[int, str, int, int]] = []
    covariances, variances, warnings, statuses = [], [], [], []
    for i, (problem, theta, ended, _) in enumerate(found):
        status = ended
        jacobian = problem.jacobian(theta)
        variance = float(np.sum(problem.residual(theta) ** 2) / (rows - len(theta)))
        root = inverse_root(jacobian, rows * np.finfo(float).eps)
        if root is None:
            status = "rank_deficient"
            warnings.append(
                f"output {i + 1}: the data do not determine all parameters: lower nf and nb (poles "
                "and zeros that cancel), or excite more"
            )
            covariances.append(np.full((len(theta), len(theta)), np.nan))
        else:
            covariances.append(variance * root @ root.T)
        if status == "max_evaluations":
            warnings.append(f"output {i + 1}: stopped at the limit; allow more evaluations")
        statuses.append(status)
        variances.append(variance)
        for j in range(problem.n_inputs):
            for kind, first, count in (
                ("B", problem.nk[j], problem.nb[j]),
                ("F", 1, problem.nf[j]),
            ):
                for lag in range(int(first), int(first + count)):
                    owners.append((i, kind, j, lag))
                    names.append(f"{kind}{i + 1}{j + 1}[{lag}]")
    ranking = ("rank_deficient", "max_evaluations", "converged")
    split = [problem.split(theta) for problem, theta, _, _ in found]
    return OutputErrorModel(
        sample_time_s=sample_time_s,
        b=tuple(tuple(b) for b, _ in split),
        f=tuple(tuple(f) for _, f in split),
        names=tuple(names),
        values=np.concatenate([theta for _, theta, _, _ in found]),
        covariance=linalg.block_diag(*covariances),
        noise_variance=np.asarray(variances),
        status=min(statuses, key=ranking.index),
        evaluations=sum(n for *_, n in found),
        n_rows=rows,
        warnings=tuple(warnings),
        owners=tuple(owners),
    )


def _delayed(x: Real, lag: int, n: int) -> Real:
    out = np.zeros(n)
    if lag < n:
        out[lag:] = x[: n - lag]
    return out
