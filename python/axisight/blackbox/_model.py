"""Discrete linear state-space models, to which every time-domain method here converts."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import signal

from axisight.blackbox._data import Complex, Real, lines
from axisight.display.summary import summarized
from axisight.errors import InputError, MissingExtraError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment
from axisight.statistics.recursion import states


@summarized
@dataclass(frozen=True)
class StateSpaceModel:
    """A model in innovations form, Wernholt (2004), (3.26).

        x(t+T) = A x(t) + B u(t) + K e(t),   y(t) = C x(t) + D u(t) + e(t)

    ``a`` (n, n), ``b`` (n, m), ``c`` (p, n), ``d`` (p, m), ``k`` (n, p), zero for an
    output-error model; ``noise_covariance`` (p, p) of e; ``sample_time_s`` [s].
    """

    sample_time_s: float
    a: Real
    b: Real
    c: Real
    d: Real
    k: Real
    noise_covariance: Real

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.a.shape[0])

    @property
    def poles(self) -> Complex:
        """Eigenvalues of A, slowest (largest) first."""
        values = np.linalg.eigvals(self.a).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(np.abs(np.linalg.eigvals(self.a)) < 1)) if self.order else True

    def modes(self) -> xr.Dataset:
        """Return the poles as modes of continuous time, slowest first.

        Variables over ``mode``: ``pole`` (z), ``eigenvalue_rad_s`` (ln z / T), ``frequency_hz`` and
        ``damping_ratio``. A complex pair is one mode. Poles at zero are delays and are left out.
        """
        return modes_of(self.poles, self.sample_time_s)

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return G(e^{iwT}) in the format of `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are
        labels. The variance is NaN, because the matrices have none. A line on a pole is NaN. Raises
        InputError for other frequencies.
        """
        f = lines(frequency_hz, self.sample_time_s)
        z = np.exp(2j * np.pi * f * self.sample_time_s)
        return frequency_response(
            f,
            evaluate(self.a, self.b, self.c, self.d, z),
            estimator="state_space",
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"order": self.order},
        )

    def simulate(self, experiment: Experiment, initial_state: ArrayLike | None = None) -> Real:
        """Return the simulated output (n, p) for the input of ``experiment`` alone.

        ``initial_state`` (n_states,) is zero, at rest, by default. Raises InputError for another shape,
        and if channels or sample time differ from the model's.
        """
        self._expect(experiment)
        return _run(self.a, self.b, self.c, self.d, experiment.input, self._start(initial_state))

    def predict(self, experiment: Experiment, initial_state: ArrayLike | None = None) -> Real:
        """Return the one-step prediction (n, p), Wernholt (2004), (3.33).

        ``experiment`` gives input and output; ``initial_state`` and errors as in `simulate`.
        """
        self._expect(experiment)
        both = np.hstack([experiment.input, experiment.output])
        a = self.a - self.k @ self.c
        b = np.hstack([self.b - self.k @ self.d, self.k])
        d = np.hstack([self.d, np.zeros((self.c.shape[0], self.c.shape[0]))])
        return _run(a, b, self.c, d, both, self._start(initial_state))

    def to_scipy(self) -> signal.StateSpace:
        """Return a discrete ``scipy.signal.StateSpace``, without the noise model."""
        return signal.StateSpace(self.a, self.b, self.c, self.d, dt=self.sample_time_s)

    def to_control(self) -> Any:
        """Return a ``control.StateSpace``, without the noise model.

        Raises MissingExtraError without python-control.
        """
        return control_module().ss(self.a, self.b, self.c, self.d, self.sample_time_s)

    def _start(self, state: ArrayLike | None) -> Real:
        if state is None:
            return np.zeros(self.order)
        x = np.asarray(state, np.float64)
        if x.shape != (self.order,) or not np.isfinite(x).all():
            raise InputError(f"initial_state: expected {self.order} finite numbers, got {state!r}")
        return x

    def _expect(self, experiment: Experiment) -> None:
        expect_experiment(experiment, self.d.shape[1], self.d.shape[0], self.sample_time_s)


def expect_experiment(experiment: Experiment, n_in: int, n_out: int, sample_time_s: float) -> None:
    """Raise InputError if channels or sample time of an experiment differ from the model's."""
    got = (experiment.input.shape[1], experiment.output.shape[1])
    if got != (n_in, n_out):
        raise InputError(
            f"experiment: expected {n_in} inputs and {n_out} outputs, got {got[0]} and {got[1]}"
        )
    if abs(experiment.sample_time_s - sample_time_s) > 1e-9 * sample_time_s:
        raise InputError(
            f"experiment: expected the sample time {sample_time_s} s of the model, got "
            f"{experiment.sample_time_s} s"
        )


def evaluate(a: Real, b: Real, c: Real, d: Real, at: Complex) -> Complex:
    """Return C (s I - A)^-1 B + D at each s of ``at``; NaN on a pole."""
    out = np.full((len(at), *d.shape), np.nan, np.complex128)
    eye = np.eye(len(a))
    for k, s in enumerate(at):
        try:
            out[k] = c @ np.linalg.solve(s * eye - a, b) + d
        except np.linalg.LinAlgError:
            continue  # on a pole: stays NaN
    return out


def modes_of(poles: Complex, sample_time_s: float | None) -> xr.Dataset:
    """Return the modes of discrete poles, or of continuous poles if ``sample_time_s`` is None."""
    upper = poles[(poles.imag >= 0) & ((sample_time_s is None) | (np.abs(poles) > 1e-12))]
    rate = upper if sample_time_s is None else np.log(upper) / sample_time_s
    order = np.argsort(np.abs(rate), kind="stable")
    upper, rate = upper[order], rate[order]
    size = np.abs(rate)
    damping = np.where(size > 0, -rate.real / np.where(size > 0, size, 1.0), 1.0)
    return xr.Dataset(
        {
            "pole": ("mode", upper),
            "eigenvalue_rad_s": ("mode", rate, {"units": "rad/s"}),
            "frequency_hz": ("mode", size / (2 * np.pi), {"units": "Hz"}),
            "damping_ratio": ("mode", damping),
        }
    )


def control_module() -> Any:
    """Return the module ``control``; raises MissingExtraError if it is not installed."""
    try:
        return importlib.import_module("control")
    except ImportError as error:
        raise MissingExtraError(
            "python-control is not installed: pip install 'axisight[control]'"
        ) from error


def _run(a: Real, b: Real, c: Real, d: Real, u: Real, x: Real) -> Real:
    found = states(a, (u @ b.T)[:, :, None], x[:, None])[:-1, :, 0]
    return np.asarray(found @ c.T + u @ d.T)
