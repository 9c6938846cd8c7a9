"""The result of a prediction-error fit of polynomials."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from axisight.blackbox._data import (
    Complex,
    Real,
    lines,
    parameter_table,
    response_variance,
    slowest_first,
)
from axisight.blackbox._model import StateSpaceModel, expect_experiment
from axisight.blackbox.prediction_error._realization import innovations_form
from axisight.blackbox.prediction_error._row import RowOrders, RowPolynomials, RowProblem
from axisight.blackbox.residuals import ResidualTests, residual_tests
from axisight.display.summary import summarized
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment


@summarized
@dataclass(frozen=True)
class PolynomialModel:
    """A model (3.21) with its uncertainty, from `polynomial_model`, `armax` or `box_jenkins`.

    ``polynomials`` holds the polynomials in q^-1 of every output: ``a[j]`` by output, ``b[j]`` and
    ``f[j]`` by input (from 0, delays included), ``c`` and ``d``. ``names`` (``B12[1]``: equation of
    output 1, input 2, lag 1; ``C1[2]``), ``values`` and ``covariance`` run over all parameters.
    ``noise_covariance`` (p, p) is that of e. ``n_rows`` counts samples less those that the unknown
    pasts take up. ``status`` is that of the worst output: ``converged``, ``max_evaluations`` or
    ``rank_deficient`` (standard errors are NaN). ``warnings`` say what to do.
    """

    sample_time_s: float
    polynomials: tuple[RowPolynomials, ...] = field(repr=False)
    orders: tuple[RowOrders, ...] = field(repr=False)
    values: Real
    covariance: Real = field(repr=False)
    noise_covariance: Real
    status: str
    evaluations: int
    n_rows: int
    warnings: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(
            f"{kind}{i + 1}[{lag}]" if kind in "CD" else f"{kind}{i + 1}{j + 1}[{lag}]"
            for i, row in enumerate(self.orders)
            for kind, j, lag in row.owners()
        )

    @property
    def std(self) -> Real:
        """Standard errors of ``values``, for white prediction errors."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def poles(self) -> Complex:
        """Poles of the plant: roots of det A and of every F, slowest (largest) first."""
        a = _stacked([row.a for row in self.polynomials])
        lags, p = len(a) - 1, a.shape[1]
        companion = np.eye(p * lags, k=-p)
        if lags:
            companion[:p] = np.hstack(list(-a[1:]))
        every = [np.linalg.eigvals(companion)] if lags else []
        every += [np.roots(f) for row in self.polynomials for f in row.f]
        return slowest_first(np.concatenate([np.zeros(0), *every]).astype(np.complex128))

    @property
    def stable(self) -> bool:
        """Whether every pole of the plant lies inside the unit circle."""
        return bool(np.all(np.abs(self.poles) < 1))

    def parameters(self) -> xr.Dataset:
        """Return values and standard errors over ``parameter``."""
        return parameter_table(
            self.names, self.values, self.std, n_rows=self.n_rows, status=self.status
        )

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return G = A^-1 B/F at e^{iwT} and its variance, as `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are labels.
        The variance follows from the covariance of the parameters to first order. Raises InputError
        for other frequencies.
        """
        f = lines(frequency_hz, self.sample_time_s)
        g, slope = self.response_slopes(f)
        return frequency_response(
            f,
            g,
            estimator="prediction_error",
            variance=response_variance(slope, self.covariance),
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"n_rows": self.n_rows, "status": self.status},
        )

    def response_slopes(self, frequency_hz: ArrayLike) -> tuple[Complex, Complex]:
        """Return G (n_freq, p, m) and its derivatives (n_freq, p, m, n_parameters).

        ``frequency_hz`` [Hz] ascends, up to Nyquist; InputError otherwise.
        """
        z = np.exp(2j * np.pi * lines(frequency_hz, self.sample_time_s) * self.sample_time_s)
        a = np.stack([_at(row.a, z) for row in self.polynomials], axis=1)
        bottom = np.stack([_at(row.f, z) for row in self.polynomials], axis=1)
        ratio = np.stack([_at(row.b, z) for row in self.polynomials], axis=1) / bottom
        inverse = np.linalg.inv(a)
        g = inverse @ ratio
        slope = np.zeros((*g.shape, len(self.values)), np.complex128)
        k = 0
        for i, row in enumerate(self.orders):
            for kind, j, lag in row.owners():
                late = z**-lag
                if kind == "A":
                    slope[..., k] = -(late[:, None] * inverse[:, :, i])[..., None] * g[:, None, j]
                elif kind in "BF":
                    top = late if kind == "B" else -late * ratio[:, i, j]
                    slope[:, :, j, k] = inverse[:, :, i] * (top / bottom[:, i, j])[:, None]
                k += 1
        return g, slope

    def noise_response(self, frequency_hz: ArrayLike) -> Complex:
        """Return the noise model H = A^-1 C/D at e^{iwT}, (n_freq, p, p), for frequencies [Hz]."""
        z = np.exp(2j * np.pi * lines(frequency_hz, self.sample_time_s) * self.sample_time_s)
        a = np.stack([_at(row.a, z) for row in self.polynomials], axis=1)
        ratio = np.stack([_at([r.c], z) / _at([r.d], z) for r in self.polynomials], axis=2)[:, 0]
        return np.asarray(np.linalg.inv(a) * ratio[:, None])

    def simulate(self, experiment: Experiment) -> Real:
        """Return the output (n, p) for the input of ``experiment`` alone, from rest."""
        return self.to_state_space().simulate(experiment)

    def predict(self, experiment: Experiment) -> Real:
        """Return the one-step prediction (n, p), (3.32), with the best past before the first sample.

        ``experiment`` gives input and output. Raises InputError if its channels or sample time differ
        from the model's.
        """
        p, m = len(self.orders), len(self.orders[0].nb)
        expect_experiment(experiment, m, p, self.sample_time_s)
        out = np.empty(experiment.output.shape)
        place = 0
        for i, row in enumerate(self.orders):
            problem = RowProblem(row, [experiment.input], [experiment.output], True)
            theta = self.values[place : place + row.n_parameters]
            out[:, i] = experiment.output[:, i] - problem.residual(theta)
            place += row.n_parameters
        return out

    def residual_tests(
        self, experiment: Experiment, *, lags: int = 25, probability: float = 0.99
    ) -> ResidualTests:
        """Return `axisight.blackbox.residual_tests` of the one-step errors on ``experiment``.

        ``lags`` and ``probability`` are passed on. The samples that the unknown past takes up are left
        out. The test of independence begins at lag 1 if every input acts with a delay: a controller may
        then act within the sample.
        """
        lead = max(row.memory for row in self.orders)
        left = (experiment.output - self.predict(experiment))[lead:]
        delayed = all(np.all(row.nk[row.nb > 0] > 0) for row in self.orders)
        return residual_tests(
            left,
            experiment.input[lead:],
            lags=lags,
            probability=probability,
            first_lag=int(delayed),
        )

    def to_state_space(self) -> StateSpaceModel:
        """Return the same model in innovations form (3.26)."""
        return innovations_form(self.polynomials, self.noise_covariance, self.sample_time_s)


def _at(polynomials: list[Real], z: Complex) -> Complex:
    """Return the values (n_freq, len(polynomials)) of polynomials in 1/z."""
    return np.stack([np.polyval(p[::-1], 1 / z) for p in polynomials], axis=1)


def _stacked(rows: list[list[Real]]) -> Real:
    """Return polynomials by row and column as coefficients (lags, rows, columns)."""
    length = max(len(p) for row in rows for p in row)
    padded = [[np.pad(p, (0, length - len(p))) for p in row] for row in rows]
    return np.moveaxis(np.asarray(padded), 2, 0)
