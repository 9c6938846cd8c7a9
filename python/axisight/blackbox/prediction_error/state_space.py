"""State-space models by the prediction-error method, Wernholt (2004), (3.26) and (3.33)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import linalg, optimize

from axisight.arguments import instance, one_of, switch
from axisight.blackbox._data import Complex, Real, gathered, lines, response_variance, whole
from axisight.blackbox._model import StateSpaceModel, expect_experiment
from axisight.blackbox.prediction_error._innovations import InnovationsProblem, Layout, Matrices
from axisight.blackbox.residuals import ResidualTests, residual_tests
from axisight.blackbox.subspace import state_space
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment
from axisight.statistics.least_squares import inverse_root

ROUNDS = 12
"""Most updates of the weights; with one output a second round confirms the first."""

SETTLED = 1e-6
"""Relative change of the loss at which the weights have settled."""

NEAR_CIRCLE = 1e-3
"""Poles of the predictor this near the unit circle are reported."""

LEAST_NOISE = 1e-7
"""Errors of an output below this share of its size count as this share, so that weights stay finite."""


@summarized
@dataclass(frozen=True)
class InnovationsModel:
    """A prediction-error state-space model with its uncertainty.

    ``model`` is the innovations form. ``covariance`` is that of the entries of A, B, C, D (if
    ``direct``) and K (if ``noise`` is ``"estimate"``), row by row, in the coordinates of ``model``.
    It has no part along changes of coordinates, so it holds for responses and poles. ``loss`` is
    det of the covariance of the errors. ``status`` is ``converged``, ``max_evaluations`` or
    ``rank_deficient`` (the covariance is NaN). ``warnings`` say what to do.
    """

    model: StateSpaceModel
    covariance: Real = field(repr=False)
    direct: bool
    noise: str
    loss: float
    status: str
    evaluations: int
    n_rows: int
    warnings: tuple[str, ...]

    @property
    def poles(self) -> Complex:
        """Eigenvalues of A, slowest (largest) first."""
        return self.model.poles

    @property
    def stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return self.model.stable

    @property
    def noise_covariance(self) -> Real:
        """Covariance (p, p) of the prediction errors."""
        return self.model.noise_covariance

    def modes(self) -> xr.Dataset:
        """Return the modes as `StateSpaceModel.modes` does."""
        return self.model.modes()

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return G (3.28) at e^{iwT} and its variance, as `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are labels.
        The variance follows from the covariance of the matrices to first order, for white prediction
        errors. Raises InputError for other frequencies.
        """
        f = lines(frequency_hz, self.model.sample_time_s)
        g, slope = self.response_slopes(f)
        return frequency_response(
            f,
            g,
            estimator="prediction_error",
            variance=response_variance(slope, self.covariance),
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"n_rows": self.n_rows, "status": self.status, "order": self.model.order},
        )

    def response_slopes(self, frequency_hz: ArrayLike) -> tuple[Complex, Complex]:
        """Return G (n_freq, p, m) and its derivatives (n_freq, p, m, n_parameters).

        ``frequency_hz`` [Hz] ascends, up to Nyquist; InputError otherwise.
        """
        x = self.model
        n, m, p = x.order, x.d.shape[1], x.d.shape[0]
        z = np.exp(2j * np.pi * lines(frequency_hz, x.sample_time_s) * x.sample_time_s)
        inverse = np.linalg.inv(z[:, None, None] * np.eye(n) - x.a)
        left, right = x.c @ inverse, inverse @ x.b
        ones_m, ones_p = np.eye(m), np.eye(p)
        shape = (len(z), p, m, -1)
        parts = [
            np.einsum("fir,fjk->fikrj", left, right).reshape(shape),
            np.einsum("fir,jk->fikrj", left, ones_m).reshape(shape),
            np.einsum("ir,fjk->fikrj", ones_p, right).reshape(shape),
        ]
        if self.direct:
            part = np.einsum("ir,jk->ikrj", ones_p, ones_m).reshape(1, p, m, -1)
            parts.append(np.repeat(part, len(z), axis=0).astype(np.complex128))
        slope = np.concatenate(parts, axis=3)
        missing = len(self.covariance) - slope.shape[3]
        slope = np.concatenate([slope, np.zeros((len(z), p, m, missing))], axis=3)
        return np.asarray(left @ x.b + x.d), np.asarray(slope, np.complex128)

    def noise_response(self, frequency_hz: ArrayLike) -> Complex:
        """Return the noise model H (3.29) at e^{iwT}, (n_freq, p, p), for frequencies [Hz]."""
        x = self.model
        z = np.exp(2j * np.pi * lines(frequency_hz, x.sample_time_s) * x.sample_time_s)
        solved = np.linalg.solve(z[:, None, None] * np.eye(x.order) - x.a, x.k[None])
        return np.asarray(x.c @ solved + np.eye(len(x.d)))

    def simulate(self, experiment: Experiment) -> Real:
        """Return the output (n, p) for the input of ``experiment`` alone, from rest."""
        return self.model.simulate(experiment)

    def predict(self, experiment: Experiment) -> Real:
        """Return the one-step prediction (n, p), (3.33), from the first state that fits best.

        ``experiment`` gives input and output. Raises InputError if its channels or sample time differ
        from the model's.
        """
        x = self.model
        p, m = x.d.shape
        expect_experiment(experiment, m, p, x.sample_time_s)
        return np.asarray(
            experiment.output - problem_of(self, [experiment]).errors(matrices_of(self))[0]
        )

    def residual_tests(
        self, experiment: Experiment, *, lags: int = 25, probability: float = 0.99
    ) -> ResidualTests:
        """Return `axisight.blackbox.residual_tests` of the one-step errors on ``experiment``.

        ``lags`` and ``probability`` are passed on. As many samples as states are left out. Without a
        direct term the test of independence begins at lag 1: a controller may then act within the
        sample.
        """
        left = (experiment.output - self.predict(experiment))[self.model.order :]
        return residual_tests(
            left,
            experiment.input[self.model.order :],
            lags=lags,
            probability=probability,
            first_lag=int(not self.direct),
        )

    def to_state_space(self) -> StateSpaceModel:
        """Return ``model``."""
        return self.model


def problem_of(model: InnovationsModel, experiments: Sequence[Experiment]) -> InnovationsProblem:
    """Return the search problem on ``experiments``, weighted by the noise of the model."""
    p, m = model.model.d.shape
    return InnovationsProblem(
        Layout(model.model.order, m, p, model.direct, model.noise == "estimate"),
        [e.input for e in experiments],
        [e.output for e in experiments],
        _weight(model.model.noise_covariance),
        True,
    )


def matrices_of(model: InnovationsModel) -> Matrices:
    """Return the matrices of the innovations form."""
    x = model.model
    return Matrices(x.a, x.b, x.c, x.d, x.k)


def state_space_pem(
    experiments: Experiment | Sequence[Experiment],
    order: int,
    *,
    noise: str = "estimate",
    direct: bool = False,
    start: StateSpaceModel | None = None,
    window: int | None = None,
    initial: str = "estimate",
    max_evaluations: int = 100,
) -> InnovationsModel:
    """Return the state-space model in innovations form with the least prediction errors.

    experiments
        `axisight.records.experiment.Experiment`, all with the same sample time and channels.
        Subtract offsets first.
    order
        Number of states; see `axisight.blackbox.state_space_orders`.
    noise
        ``"estimate"`` frees the gain K; ``"none"`` sets it to zero (output error), for white
        measurement noise and a stable plant.
    direct
        Whether the input acts within its sample (D). Leave it False in closed loop unless the
        controller has a delay.
    start
        Model to start from; by default `axisight.blackbox.state_space` with ``window``.
    window
        Window of the default start.
    initial
        ``"estimate"`` frees the first state of every experiment; ``"zero"`` for experiments that
        begin at rest.
    max_evaluations
        Most evaluations of the search, over all updates of the weights.

    The loss is det of the covariance of the errors, the likelihood of Gaussian noise. The predictor
    stays stable; the plant may integrate or be unstable with ``noise="estimate"``.

    Raises InputError for misuse, for experiments that are too short, and for a start without a stable
    predictor; non-convergence is a status. Source: Ljung (1999), sections 7.2 and 10.2.
    """
    data = gathered(experiments, "experiments")
    n = whole("order", order, 1)
    one_of("noise", noise, ("estimate", "none"))
    one_of("initial", initial, ("estimate", "zero"))
    limit = whole("max_evaluations", max_evaluations, 1)
    p, m = data[0].output.shape[1], data[0].input.shape[1]
    layout = Layout(n, m, p, switch("direct", direct), noise == "estimate")
    if start is None:
        start = state_space(data, n, window=window, direct=direct).model
    instance("start", start, StateSpaceModel)
    if start.order != n or start.d.shape != (p, m):
        raise InputError(f"start: expected order {n}, {m} inputs and {p} outputs")
    scales = [_scale([getattr(e, name) for e in data]) for name in ("input", "output")]
    problem = InnovationsProblem(
        layout,
        [e.input / scales[0] for e in data],
        [e.output / scales[1] for e in data],
        np.eye(p),
        initial == "estimate",
    )
    if problem.n_values <= n * (m + 2 * p) + p * m:
        raise InputError(
            f"experiments: expected more than {n * (m + 2 * p) + p * m} measured values for order "
            f"{n}, got {problem.n_values}"
        )
    noise_power = start.noise_covariance / np.outer(scales[1], scales[1])
    begun = _stabilized(_scaled(start, *scales), noise_power, layout)
    return _fitted(problem, begun, limit, scales, data[0].sample_time_s)


def _scale(signals: list[Real]) -> Real:
    size = np.sqrt(np.mean(np.concatenate(signals) ** 2, axis=0))
    return np.where(size > 0, size, 1.0)


def _scaled(x: StateSpaceModel, u: Real, y: Real) -> Matrices:
    """Return the matrices for inputs divided by ``u`` and outputs divided by ``y``."""
    return Matrices(x.a, x.b * u, x.c / y[:, None], x.d * u / y[:, None], x.k * y)


def _unscaled(x: Matrices, u: Real, y: Real) -> Matrices:
    """Return the inverse of `_scaled`."""
    return Matrices(x.a, x.b / u, x.c * y[:, None], x.d / u * y[:, None], x.k / y)


def _stabilized(x: Matrices, noise: Real, layout: Layout) -> Matrices:
    """Return the start with a stable predictor: K of the Kalman filter with the same noise spectrum."""
    if not layout.noise:
        x = replace(x, k=np.zeros_like(x.k))
    if x.stable_predictor:
        return x
    if layout.noise:
        # White noise at every state makes the filter stable where K alone is not.
        cross = x.k @ noise
        drive = cross @ x.k.T
        for floor in (0.0, 1e-6, 1e-3):
            state = drive + floor * max(np.trace(drive), np.trace(noise)) * np.eye(layout.n)
            try:
                s = linalg.solve_discrete_are(x.a.T, x.c.T, state, noise, s=cross)
            except (np.linalg.LinAlgError, ValueError):
                continue
            gain = np.linalg.solve(x.c @ s @ x.c.T + noise, (x.a @ s @ x.c.T + cross).T).T
            found = replace(x, k=np.asarray(gain, np.float64))
            if found.stable_predictor:
                return found
    raise InputError(
        "experiments: found no start with a stable predictor: use noise='estimate' for a plant that "
        "integrates, another order, or give start"
    )


def _weight(noise: Real) -> Real:
    """Return W with W noise W^T = I; exact outputs count as LEAST_NOISE of their size."""
    values, vectors = np.linalg.eigh(noise)
    floor = max(LEAST_NOISE**2 * float(values[-1]), np.finfo(float).tiny)
    return np.asarray(vectors.T / np.sqrt(np.maximum(values, floor))[:, None])


def _noise(problem: InnovationsProblem, x: Matrices, lost: float = 0.0) -> Real:
    """Return the mean square (p, p) of the errors, corrected for ``lost`` values per output."""
    e = np.concatenate(problem.errors(x))
    return np.asarray(e.T @ e / max(len(e) - lost, 1.0))


@dataclass(frozen=True)
class _Found:
    x: Matrices
    problem: InnovationsProblem
    evaluations: int
    settled: bool


def _search(problem: InnovationsProblem, x: Matrices, limit: int) -> _Found:
    """Return the result of alternating searches and updates of the weights."""
    used, last, settled = 0, np.inf, False
    for _ in range(ROUNDS):
        x = x.balanced()
        noise = _noise(problem, x) + LEAST_NOISE**2 * np.eye(problem.layout.p)
        problem = replace(problem, weight=_weight(noise))
        theta, ways = problem.layout.vector(x), problem.layout.directions(x)

        result = _local_search(problem, theta, ways, max(limit - used, 1))
        used += int(result.nfev)
        x = problem.layout.matrices(theta + ways @ result.x)
        loss = float(np.linalg.slogdet(_noise(problem, x))[1])
        settled = result.status != 0 and abs(last - loss) < SETTLED
        last = loss
        if settled or used >= limit:
            break
    return _Found(x, problem, used, settled)


def _local_search(
    problem: InnovationsProblem, theta: Real, ways: Real, limit: int
) -> optimize.OptimizeResult:
    """Return the search from ``theta`` in the directions that change the model."""

    def residual(step: Real) -> Real:
        return problem.residual(theta + ways @ step)

    def slope(step: Real) -> Real:
        return np.asarray(problem.jacobian(theta + ways @ step) @ ways)

    return optimize.least_squares(
        residual,
        np.zeros(ways.shape[1]),
        slope,
        method="trf",
        x_scale="jac",
        xtol=1e-10,
        ftol=1e-12,
        gtol=1e-12,
        max_nfev=limit,
    )


def _fitted(
    problem: InnovationsProblem, x: Matrices, limit: int, scales: list[Real], step: float
) -> InnovationsModel:
    found = _search(problem, x, limit)
    x, problem, layout = found.x, found.problem, found.problem.layout
    ways = layout.directions(x)
    firsts = len(problem.outputs) * layout.n if problem.transients else 0
    noise = _noise(problem, x, (ways.shape[1] + firsts) / layout.p)
    problem = replace(problem, weight=_weight(noise))
    slope = problem.jacobian(layout.vector(x)) @ ways
    root = inverse_root(slope, len(slope) * np.finfo(float).eps)
    status = "converged" if found.settled else "max_evaluations"
    warnings = []
    if root is None:
        status = "rank_deficient"
        warnings.append("the data do not determine the model: lower the order, or excite more")
        covariance = np.full((len(ways), len(ways)), np.nan)
    else:
        covariance = ways @ root @ (ways @ root).T
    if np.any(np.abs(np.linalg.eigvals(x.predictor)) > 1 - NEAR_CIRCLE):
        warnings.append(
            "a zero of the noise model is at the unit circle, so standard errors do not hold: remove "
            "offsets and drift, or do not difference the output"
        )
    if status == "max_evaluations":
        warnings.append("stopped at the limit; allow more evaluations, or lower the order")
    u, y = scales
    ones = Matrices(*(np.ones_like(v) for v in (x.a, x.b, x.c, x.d, x.k)))
    back = layout.vector(_unscaled(ones, u, y))
    own = _unscaled(x, u, y)
    power = np.outer(y, y)
    model = StateSpaceModel(step, own.a, own.b, own.c, own.d, own.k, noise * power)
    if not model.stable:
        warnings.append(f"unstable: largest pole {np.max(np.abs(model.poles)):.4f}")
    return InnovationsModel(
        model=model,
        covariance=np.asarray(covariance * np.outer(back, back)),
        direct=layout.direct,
        noise="estimate" if layout.noise else "none",
        loss=float(np.linalg.det(_noise(problem, x) * power)),
        status=status,
        evaluations=found.evaluations,
        n_rows=sum(map(len, problem.outputs)),
        warnings=tuple(warnings),
    )
