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
from scipy import linalg, optimize

from axisight.blackbox._data import (
    Complex,
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
from axisight.blackbox._output_error_problem import OutputErrorProblem, start_of
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment
from axisight.statistics.least_squares import inverse_root


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
        problem = OutputErrorProblem(
            orders_b[i],
            orders_f[i],
            delays[i],
            [e.input for e in data],
            [e.output[:, i] for e in data],
            left_out,
        )
        found.append((problem, *_searched(problem, limit, i)))
    return _model(found, data[0].sample_time_s, rows)


def _searched(problem: OutputErrorProblem, limit: int, output: int) -> tuple[Real, str, int]:
    first = start_of(problem, output)
    result = optimize.least_squares(
        problem.residual,
        first,
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


def _model(
    found: list[tuple[OutputErrorProblem, Real, str, int]], sample_time_s: float, rows: int
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
