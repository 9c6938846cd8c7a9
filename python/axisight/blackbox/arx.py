"""ARX models by QR, Wernholt (2004), (3.24) and (3.35)-(3.38), for several inputs and outputs.

    y_i(t) + sum_j sum_l A_ij[l] y_j(t - l) = sum_j sum_l B_ij[l] u_j(t - l) + e_i(t)

The lags of A_ij run from 1 to na_ij, those of B_ij from nk_ij to nk_ij + nb_ij - 1. Each output
is a linear regression of its own (3.35). All share one triangular factor R of the regressors
and outputs at the largest lags: from it follow the estimate, its covariance, and the loss of
every smaller order, without going back to the data. Experiments are merged, never joined end to
end: each gives up as many samples as the largest lag for its first regressor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import linalg

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
)
from axisight.blackbox._model import StateSpaceModel, expect_experiment
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment
from axisight.statistics.least_squares import unit_columns

CHUNK = 2048
"""Rows of a narrow regressor that are triangularized at a time: a block that stays in the cache."""


@dataclass(frozen=True)
class Triangle:
    """Triangular factor of ``[regressors, outputs]`` over all experiments.

    ``labels`` names the columns before the outputs: (kind, channel, lag) with kind "y" or "u".
    """

    r: Real
    labels: tuple[tuple[str, int, int], ...]
    n_rows: int
    n_outputs: int

    def columns(self, na: Integers, nb: Integers, nk: Integers, output: int) -> list[int]:
        """Return the columns that the equation of one output (from 0) uses."""
        wanted = []
        for place, (kind, channel, lag) in enumerate(self.labels):
            if kind == "y":
                used = lag <= na[output, channel]
            else:
                first = nk[output, channel]
                used = first <= lag < first + nb[output, channel]
            if used:
                wanted.append(place)
        return wanted


@summarized
@dataclass(frozen=True)
class ARXModel:
    """An ARX model with its uncertainty.

    For p outputs and m inputs, ``na`` (p, p), ``nb`` and ``nk`` (p, m) are the orders. ``a``
    (lags, p, p) and ``b`` (lags, p, m) are the coefficients by lag from 0; a[0] is the identity.
    ``names`` (``A12[1]``: equation of output 1, output 2, lag 1), ``values`` and ``covariance`` run
    over all parameters, one output after the other. ``noise_covariance`` (p, p) is that of e, and
    ``n_rows`` counts the equations used. ``condition`` is the largest condition number of the
    regressors, scaled to unit norm, over the outputs.
    """

    sample_time_s: float
    na: Integers
    nb: Integers
    nk: Integers
    a: Real
    b: Real
    names: tuple[str, ...]
    values: Real
    covariance: Real = field(repr=False)
    noise_covariance: Real
    n_rows: int
    condition: float
    owners: tuple[tuple[int, str, int, int], ...] = field(repr=False)
    """For each parameter: output, kind, channel and lag, from 0."""

    @property
    def std(self) -> Real:
        """Standard errors of ``values``, for white residuals."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def poles(self) -> Complex:
        """Roots of det A, slowest (largest) first; those at zero are delays."""
        lags, p = len(self.a) - 1, self.a.shape[1]
        if lags == 0:
            return np.zeros(0, np.complex128)
        companion = np.eye(p * lags, k=-p)
        companion[:p] = np.hstack(list(-self.a[1:]))
        return slowest_first(np.linalg.eigvals(companion).astype(np.complex128))

    @property
    def stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(np.abs(self.poles) < 1))

    def parameters(self) -> xr.Dataset:
        """Return values and standard errors over ``parameter``."""
        return parameter_table(
            self.names, self.values, self.std, n_rows=self.n_rows, condition=self.condition
        )

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return G(e^{iwT}) = A^-1 B and its variance, in the format of `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are
        labels. The variance follows from the covariance of the parameters to first order. A line on a
        pole, to rounding, is NaN and flagged. Raises InputError for other frequencies.
        """
        f = lines(frequency_hz, self.sample_time_s)
        z = np.exp(2j * np.pi * f * self.sample_time_s)
        inverse = _inverse_polynomial(self.a, z)
        g = np.asarray(inverse @ _polynomial(self.b, z), np.complex128)
        return frequency_response(
            f,
            g,
            estimator="arx",
            variance=self._variance(z, inverse, g),
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"n_rows": self.n_rows},
        )

    def _variance(self, z: Complex, inverse: Complex, g: Complex) -> Real:
        # A dG = dB - dA G, so element (o, j) moves by sum_i (A^-1)_oi (dB - dA G)_ij.
        n_out, n_in = g.shape[1:]
        slope = np.zeros((len(z), n_out, n_in, len(self.values)), np.complex128)
        for k, (i, kind, channel, lag) in enumerate(self.owners):
            delayed = z ** (-lag)
            if kind == "u":
                slope[:, :, channel, k] = inverse[:, :, i] * delayed[:, None]
            else:
                slope[..., k] = (
                    -inverse[:, :, i, None] * (delayed[:, None] * g[:, channel])[:, None]
                )
        return response_variance(slope, self.covariance)

    def predict(self, experiment: Experiment) -> Real:
        """Return the one-step prediction (n, p) by (3.35), NaN before the largest lag.

        ``experiment`` gives input and output. Raises InputError if its channels or sample time differ
        from the model's.
        """
        n_in = self.b.shape[2]
        expect_experiment(experiment, n_in, self.a.shape[1], self.sample_time_s)
        u, y = experiment.input, experiment.output
        start = max(len(self.a), len(self.b)) - 1
        out = np.full(y.shape, np.nan)
        n = len(y) - start
        if n <= 0:
            return out
        out[start:] = 0.0
        for lag in range(1, len(self.a)):
            out[start:] -= y[start - lag : start - lag + n] @ self.a[lag].T
        for lag in range(len(self.b)):
            out[start:] += u[start - lag : start - lag + n] @ self.b[lag].T
        return out

    def simulate(self, experiment: Experiment) -> Real:
        """Return the output (n, p) for the input of ``experiment`` alone, from rest."""
        return self.to_state_space().simulate(experiment)

    def to_state_space(self) -> StateSpaceModel:
        """Return the same model in innovations form, with p times the largest lag as its order."""
        p, m = self.b.shape[1:]
        lags = max(len(self.a), len(self.b)) - 1
        a = np.concatenate([self.a[1:], np.zeros((lags + 1 - len(self.a), p, p))])
        b = np.concatenate([self.b, np.zeros((lags + 1 - len(self.b), p, m))])
        direct = b[0]
        transition = np.eye(p * lags, k=p)
        c = np.zeros((p, p * lags))
        if lags:
            transition[:, :p] -= a.reshape(p * lags, p)
            c[:, :p] = np.eye(p)
        drive = (b[1:] - a @ direct).reshape(p * lags, m)
        gain = -a.reshape(p * lags, p)
        return StateSpaceModel(
            self.sample_time_s, transition, drive, c, direct, gain, self.noise_covariance
        )


def arx(
    experiments: Experiment | Sequence[Experiment],
    *,
    na: ArrayLike,
    nb: ArrayLike,
    nk: ArrayLike = 1,
) -> ARXModel:
    """Return the least-squares ARX model of one or several experiments, (3.38) by QR.

    experiments
        `axisight.records.experiment.Experiment`, all with the same sample time and channels.
        Subtract offsets first: the model has none.
    na
        Lags of outputs, one number or (p, p).
    nb, nk
        Lags of inputs and the first of them, one number or (p, m). With nk = 0 the input acts
        within its sample.

    Standard errors and the noise covariance hold for white residuals: test them with
    `axisight.blackbox.residual_tests`. In closed loop the estimate is consistent where the true
    system is of this form and nk is at least 1.

    Raises InputError for misuse, for experiments that are too short, and for regressors without
    full rank: input that does not excite the order, or an order above that of noise-free data.
    """
    data = gathered(experiments, "experiments")
    p, m = data[0].output.shape[1], data[0].input.shape[1]
    orders = _orders(na, nb, nk, p, m)
    triangle = triangularized(data, *orders)
    return solved(triangle, *orders, data[0].sample_time_s)


def _orders(
    na: ArrayLike, nb: ArrayLike, nk: ArrayLike, p: int, m: int
) -> tuple[Integers, Integers, Integers]:
    a = order_matrix("na", na, (p, p), 0)
    b = order_matrix("nb", nb, (p, m), 0)
    k = order_matrix("nk", nk, (p, m), 0)
    for i in range(p):
        if a[i].sum() + b[i].sum() == 0:
            raise InputError(
                f"na, nb: expected at least one parameter for output {i + 1}, got none"
            )
    return a, b, k


def triangularized(
    data: list[Experiment], na: Integers, nb: Integers, nk: Integers, lags: int | None = None
) -> Triangle:
    """Return the triangular factor at the largest lags of the orders, or at ``lags``."""
    p, m = data[0].output.shape[1], data[0].input.shape[1]
    last = np.where(nb > 0, nk + nb - 1, 0)
    most = int(max(na.max(), last.max())) if lags is None else lags
    labels = [("y", j, lag) for j in range(p) for lag in range(1, int(na[:, j].max()) + 1)]
    for j in range(m):
        used = nb[:, j] > 0
        if used.any():
            first, end = int(nk[used, j].min()), int(last[used, j].max())
            labels += [("u", j, lag) for lag in range(first, end + 1)]
    width = len(labels) + p
    r = np.zeros((0, width))
    # The triangle so far is triangularized again with each block, so wide blocks get more rows.
    rows, n_rows = max(CHUNK, 4 * width), 0
    for e in data:
        n = e.n_samples - most
        # Channels in a row each: a lag is then one plain copy.
        signals = {"y": np.ascontiguousarray(-e.output.T), "u": np.ascontiguousarray(e.input.T)}
        for start in range(0, max(n, 0), rows):
            stop = min(start + rows, n)
            block = np.empty((len(r) + stop - start, width), order="F")
            block[: len(r)] = r
            for k, (kind, channel, lag) in enumerate(labels):
                at = most - lag
                block[len(r) :, k] = signals[kind][channel, start + at : stop + at]
            block[len(r) :, len(labels) :] = e.output[start + most : stop + most]
            # The raw form comes with the triangle alone; the others clear the whole matrix below it.
            _, r = linalg.qr(block, mode="raw", overwrite_a=True, check_finite=False)
        n_rows += max(n, 0)
    widest = int(max((na.sum(axis=1) + nb.sum(axis=1)).max(), 1))
    if n_rows <= widest:
        raise InputError(
            f"experiments: expected more than {widest} samples beyond the first {most} of each, "
            f"got {n_rows}"
        )
    return Triangle(r, tuple(labels), n_rows, p)


def solved(
    triangle: Triangle, na: Integers, nb: Integers, nk: Integers, sample_time_s: float
) -> ARXModel:
    """Return the model of the given orders from a triangle that holds all their lags."""
    p, m = triangle.n_outputs, nb.shape[1]
    r, base = triangle.r, len(triangle.labels)
    a = np.zeros((int(na.max()) + 1, p, p))
    a[0] = np.eye(p)
    b = np.zeros((int(np.where(nb > 0, nk + nb, 1).max()), p, m))
    owners: list[tuple[int, str, int, int]] = []
    values, inverses, left = [], [], []
    condition = 1.0
    for i in range(p):
        columns = triangle.columns(na, nb, nk, i)
        regressor, target = r[:, columns], r[:, base + i]
        inverse, worst = _inverse(regressor, triangle.n_rows, i)
        theta = inverse @ target
        condition = max(condition, worst)
        for value, column in zip(theta, columns, strict=True):
            kind, channel, lag = triangle.labels[column]
            (a if kind == "y" else b)[lag, i, channel] = value
            owners.append((i, kind, channel, lag))
        values.append(theta)
        inverses.append(inverse)
        left.append(target - regressor @ theta)
    freedom = np.sqrt([triangle.n_rows - len(v) for v in values])
    residual = np.stack(left)
    noise = residual @ residual.T / np.outer(freedom, freedom)
    # Two equations share data: cov(theta_i, theta_j) = L_ij P_i R_i^T R_j P_j with P R = inverse.
    covariance = np.block(
        [[noise[i, j] * inverses[i] @ inverses[j].T for j in range(p)] for i in range(p)]
    )
    return ARXModel(
        sample_time_s=sample_time_s,
        na=na,
        nb=nb,
        nk=nk,
        a=a,
        b=b,
        names=tuple(_name(*owner) for owner in owners),
        values=np.concatenate(values),
        covariance=(covariance + covariance.T) / 2,
        noise_covariance=noise,
        n_rows=triangle.n_rows,
        condition=condition,
        owners=tuple(owners),
    )


def prediction_covariance(model: ARXModel, triangle: Triangle) -> Real:
    """Return the mean square (p, p) of the one-step errors of a model on a triangle's data."""
    p = triangle.n_outputs
    places = {label: k for k, label in enumerate(triangle.labels)}
    theta = np.zeros((len(triangle.labels) + p, p))
    theta[len(triangle.labels) :] = np.eye(p)
    for (output, kind, channel, lag), value in zip(model.owners, model.values, strict=True):
        theta[places[kind, channel, lag], output] = -value
    left = triangle.r @ theta
    return np.asarray(left.T @ left / triangle.n_rows)


def _name(output: int, kind: str, channel: int, lag: int) -> str:
    return f"{'A' if kind == 'y' else 'B'}{output + 1}{channel + 1}[{lag}]"


def _inverse(regressor: Real, n_rows: int, output: int) -> tuple[Real, float]:
    """Return the pseudo-inverse of a triangle's columns and their scaled condition number."""
    scaled, size = unit_columns(regressor)
    u, s, vt = np.linalg.svd(scaled, full_matrices=False)
    rank = int(np.sum(s > n_rows * np.finfo(float).eps * s[0])) if s.size else 0
    if rank < len(s):
        raise InputError(
            f"experiments: the regressors of output {output + 1} have rank {rank} of {len(s)}: an "
            "input does not excite this order, or noise-free data are of a lower one; lower "
            "na and nb, sample more slowly, or excite more"
        )
    return np.asarray((vt.T / s) @ u.T / size[:, None]), float(s[0] / s[-1])


def _inverse_polynomial(coefficients: Real, z: Complex) -> Complex:
    """Return A(z)^-1 (n, p, p) for ``coefficients`` (lags, p, p) at each z (n,); NaN on a pole."""
    matrix = _polynomial(coefficients, z)
    # On the unit circle no term is larger than its coefficients, and each rounds by eps.
    rounding = np.finfo(float).eps * len(coefficients) * float(np.abs(coefficients).sum())
    off = np.linalg.svd(matrix, compute_uv=False)[:, -1] > rounding
    out = np.full(matrix.shape, np.nan, np.complex128)
    out[off] = np.linalg.inv(matrix[off])
    return out


def _polynomial(coefficients: Real, z: Complex) -> Complex:
    powers = z[:, None] ** -np.arange(len(coefficients))
    return np.asarray(np.einsum("fl,lij->fij", powers, coefficients))
