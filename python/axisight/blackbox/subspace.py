"""State-space models by subspace methods: no start, no search, several inputs and outputs.

Both methods use one triangular factor of past inputs and outputs z(t), future inputs and future
outputs, over all experiments. A state is a linear map of the past, x(t) = M z(t).

``moesp`` (Verhaegen, 1994, with past inputs and outputs as instruments) subtracts from the future
outputs what the future inputs explain, and projects the rest on the past. The result spans the
observability matrix. A and C follow from its shift, B and D from linear least squares of the
simulated output, with the unknown initial state of each experiment eliminated. It allows any colour
of noise, but works in open loop only: feedback biases it.

``pbsid`` (Chiuso, 2007) takes the predictor's Markov parameters from a long ARX model. They give the
map from the past to the predicted future without future inputs, and its largest singular directions
are the state. Every matrix then follows by regression. It works in open and closed loop. Its error
vanishes as the window grows: it is the predictor's largest pole to the power of the window.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import linalg

from axisight.blackbox._data import Complex, Real, fit_percent, gathered, whole
from axisight.blackbox._model import StateSpaceModel
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.records.experiment import Experiment
from axisight.statistics.recursion import states

CHUNK = 4096
"""Rows that are triangularized at a time."""

STATE_NUMBERS = 1 << 22
"""Simulated state values that are kept in memory at a time."""

ROUNDING = 1e-9
"""Innovations below this share of the output are rounding, not noise."""

Method = Literal["pbsid", "moesp"]


@summarized
@dataclass(frozen=True)
class SubspaceModel:
    """A state-space model and the singular values that show its order.

    The matrices have no standard errors, because none exist in closed form; the variance of
    `response` is NaN. ``singular_values``, largest first, fall off after the order of the system.
    ``warnings`` say what to check.
    """

    model: StateSpaceModel
    method: Method
    window: int
    singular_values: Real = field(repr=False)
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

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return the response as `StateSpaceModel.response` does, with variance NaN.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are labels.
        Raises InputError for other frequencies.
        """
        return self.model.response(frequency_hz, input_unit=input_unit, output_unit=output_unit)


@dataclass(frozen=True)
class _Past:
    """Triangular factor of ``[future u, past z, u(t) last of all future, future y]``."""

    r: Real
    window: int
    n_in: int
    n_out: int
    n_rows: int
    input_scale: Real
    output_scale: Real

    @property
    def n_past(self) -> int:
        return self.window * (self.n_in + self.n_out)

    @property
    def now_u(self) -> Real:
        """Columns of u(t)."""
        return self.r[:, : self.n_in]

    @property
    def past(self) -> Real:
        """Columns of z(t): (u, y) at t - 1, then t - 2, and so on."""
        start = self.window * self.n_in
        return self.r[:, start : start + self.n_past]

    @property
    def now_y(self) -> Real:
        """Columns of y(t)."""
        start = self.window * self.n_in + self.n_past
        return self.r[:, start : start + self.n_out]

    def shifted(self) -> Real:
        """Columns of z(t + 1): (u, y) at t, then z(t) without its oldest sample."""
        kept = self.n_past - self.n_in - self.n_out
        return np.hstack([self.now_u, self.now_y, self.past[:, :kept]])


def state_space(
    experiments: Experiment | Sequence[Experiment],
    order: int,
    *,
    method: Method = "pbsid",
    window: int | None = None,
    direct: bool = False,
) -> SubspaceModel:
    """Return a state-space model of one or several experiments.

    experiments
        `axisight.records.experiment.Experiment`, all with the same sample time and channels.
        Subtract offsets first. Experiments need not start at rest.
    order
        Number of states; see `axisight.blackbox.state_space_orders`.
    method
        ``"pbsid"`` (open and closed loop) or ``"moesp"`` (open loop).
    window
        Samples of past and of future, by default twice the order and at least 10. ``window`` times
        the number of outputs must be at least ``order`` plus the number of outputs.
    direct
        Whether the input acts within its sample (D). Leave it False in closed loop: D is not
        identifiable there unless the controller has a delay.

    An unstable model is returned with a warning. Raises InputError for misuse, for experiments that
    are too short, and for input that does not excite the window.
    """
    data = gathered(experiments, "experiments")
    n = whole("order", order, 1)
    s = _window(window, n, data[0].output.shape[1])
    past = _triangle(data, s)
    return _identified(past, data, n, method, direct)


def state_space_orders(
    experiments: Experiment | Sequence[Experiment],
    orders: Iterable[int],
    *,
    validation: Experiment | Sequence[Experiment] | None = None,
    method: Method = "pbsid",
    window: int | None = None,
    direct: bool = False,
) -> xr.Dataset:
    """Return singular values and losses of prediction for each of ``orders``.

    ``experiments``, ``method``, ``window`` and ``direct`` are those of `state_space`; the default
    window is that of the largest order. Variables over ``order``:

    - ``singular_value``: the one at that order
    - ``loss``: determinant of the covariance of the one-step errors on the data
    - ``validation_loss``: the same on ``validation`` data, NaN without
    - ``simulation_fit`` (order, output): fit (3.54) on ``validation`` data [%], NaN without
    - ``stable``

    ``attrs["best_validation_loss"]`` is the order with the smallest validation loss.

    Raises InputError as `state_space` does.
    """
    data = gathered(experiments, "experiments")
    fresh = [] if validation is None else gathered(validation, "validation")
    wanted = sorted({whole("orders", n, 1) for n in orders})
    if not wanted:
        raise InputError("orders: expected at least one, got none")
    p = data[0].output.shape[1]
    past = _triangle(data, _window(window, wanted[-1], p))
    rows: dict[str, list[float]] = {"singular_value": [], "loss": [], "validation_loss": []}
    fits, stable = [], []
    for n in wanted:
        found = _identified(past, data, n, method, direct)
        rows["singular_value"].append(float(found.singular_values[n - 1]))
        rows["loss"].append(_one_step(found.model, data, past.window))
        rows["validation_loss"].append(
            _one_step(found.model, fresh, past.window) if fresh else np.nan
        )
        fits.append(_simulated(found.model, fresh, p))
        stable.append(found.stable)
    known = np.isfinite(rows["validation_loss"])
    best = wanted[int(np.nanargmin(rows["validation_loss"]))] if known.any() else -1
    return xr.Dataset(
        {
            **{name: ("order", np.asarray(values)) for name, values in rows.items()},
            "simulation_fit": (("order", "output"), np.asarray(fits), {"units": "%"}),
            "stable": ("order", np.asarray(stable)),
        },
        coords={"order": wanted, "output": np.arange(1, p + 1)},
        attrs={"method": method, "window": past.window, "best_validation_loss": best},
    )


def _window(window: int | None, order: int, n_out: int) -> int:
    if window is None:
        return max(10, 2 * order)
    s = whole("window", window, 2)
    if s * n_out < order + n_out:
        raise InputError(
            f"window: expected at least {-(-(order + n_out) // n_out)} for order {order}, got {s}"
        )
    return s


def _triangle(data: list[Experiment], s: int) -> _Past:
    m, p = data[0].input.shape[1], data[0].output.shape[1]
    scales = []
    for name in ("input", "output"):
        size = np.sqrt(np.mean(np.concatenate([getattr(e, name) for e in data]) ** 2, axis=0))
        if np.any(size == 0):
            raise InputError(f"experiments: expected {name}s that move, got a constant zero")
        scales.append(size)
    width = s * (2 * m + 2 * p)
    r, n_rows = np.zeros((0, width)), 0
    for e in data:
        u, y = e.input / scales[0], e.output / scales[1]
        z = np.hstack([u, y])
        n = e.n_samples - 2 * s + 1
        for start in range(0, max(n, 0), CHUNK):
            t = np.arange(start, min(start + CHUNK, n))[:, None] + s
            ahead = t + np.arange(s)
            behind = t - 1 - np.arange(s)
            block = [u[ahead], z[behind], y[ahead]]
            rows = np.hstack([x.reshape(len(t), -1) for x in block])
            (r,) = linalg.qr(np.vstack([r, rows]), mode="r", check_finite=False)
            r = r[:width]
        n_rows += max(n, 0)
    if n_rows < 2 * width:
        raise InputError(
            f"experiments: expected at least {2 * width} samples beyond {2 * s - 1} in each, got "
            f"{n_rows}; shorten the window"
        )
    future = r[:, : s * m]
    values = np.linalg.svd(future, compute_uv=False)
    if values[-1] <= n_rows * np.finfo(float).eps * values[0]:
        raise InputError(
            f"experiments: the inputs do not excite a window of {s} samples: use more lines, "
            "another signal, or a shorter window"
        )
    return _Past(r, s, m, p, n_rows, *scales)


def _identified(
    past: _Past, data: list[Experiment], n: int, method: Method, direct: bool
) -> SubspaceModel:
    if method == "pbsid":
        values, a, b, c, d, k = _pbsid(past, n, direct)
    elif method == "moesp":
        values, a, b, c, d, k = _moesp(past, data, n, direct)
    else:
        raise InputError(f"method: expected 'pbsid' or 'moesp', got {method!r}")
    b, d = b / past.input_scale, d / past.input_scale
    k = k / past.output_scale
    c, d = past.output_scale[:, None] * c, past.output_scale[:, None] * d
    step = data[0].sample_time_s
    draft = StateSpaceModel(step, a, b, c, d, k, np.zeros((past.n_out, past.n_out)))
    left = np.concatenate([_innovations(draft, e, past.window) for e in data])
    noise = left.T @ left / max(len(left) - n * (past.n_in + 2 * past.n_out), 1)
    model = StateSpaceModel(step, a, b, c, d, k, noise)
    warnings = []
    if not model.stable:
        warnings.append(
            f"unstable: largest pole {np.max(np.abs(model.poles)):.4f}; an integrating plant, "
            "another order or a longer window"
        )
    if np.any(np.abs(np.linalg.eigvals(a - k @ c)) > 1):
        warnings.append("the predictor is unstable: one-step predictions of it diverge")
    return SubspaceModel(model, method, past.window, values, past.n_rows, tuple(warnings))


def _pbsid(past: _Past, n: int, direct: bool) -> tuple[Real, ...]:
    z, u, y = past.past, past.now_u, past.now_y
    regressor = np.hstack([z, u]) if direct else z
    theta = _solve(regressor, y)
    markov = theta[: past.n_past].T
    block = past.n_in + past.n_out
    # Row i predicts y(t + i) from z(t): the parameters of lags beyond i, moved to the front.
    ahead = np.vstack(
        [
            np.hstack([markov[:, i * block :], np.zeros((past.n_out, i * block))])
            for i in range(past.window)
        ]
    )
    _, values, vt = np.linalg.svd(z @ ahead.T, full_matrices=False)
    scale = np.sqrt(values[:n])
    basis = vt[:n].T / scale
    state, following = z @ ahead.T @ basis, past.shifted() @ ahead.T @ basis
    return (values, *_regressed(state, following, u, y, direct))


def _regressed(state: Real, following: Real, u: Real, y: Real, direct: bool) -> tuple[Real, ...]:
    """Return A, B, C, D, K from the state, its successor, input and output."""
    n, m = state.shape[1], u.shape[1]
    seen = np.hstack([state, u]) if direct else state
    output = _solve(seen, y)
    c = output[:n].T
    d = output[n:].T if direct else np.zeros((y.shape[1], m))
    e = y - seen @ output
    # With feedback u(t) depends on e(t), so one regression takes both.
    known = np.linalg.norm(e) > ROUNDING * np.linalg.norm(y)
    together = np.hstack([state, u, e]) if known else np.hstack([state, u])
    forward = _solve(together, following).T
    a, b = forward[:, :n], forward[:, n : n + m]
    k = forward[:, n + m :] if known else np.zeros((n, y.shape[1]))
    return a, b, c, d, k


def _gain(e: Real, y: Real, left: Real) -> Real:
    """Return the gain K from innovation to state, zero without noise."""
    if np.linalg.norm(e) <= ROUNDING * np.linalg.norm(y):
        return np.zeros((left.shape[1], e.shape[1]))
    return _solve(e, left).T


def _moesp(past: _Past, data: list[Experiment], n: int, direct: bool) -> tuple[Real, ...]:
    s, m, p = past.window, past.n_in, past.n_out
    first, second = s * m, s * m + past.n_past
    between = past.r[first:second, second:]
    u, values, _ = np.linalg.svd(between.T, full_matrices=False)
    observability = u[:, :n] * np.sqrt(values[:n])
    c = observability[:p]
    a = _solve(observability[:-p], observability[p:])
    b, d = _input_matrices(a, c, data, past, direct)
    # The noise model needs the state as a map of the past.
    weight = _solve(past.r[first:second, first:second], between)
    map_ = weight @ np.linalg.pinv(observability).T
    state, following = past.past @ map_, past.shifted() @ map_
    drive = past.now_u
    e = past.now_y - state @ c.T - drive @ d.T
    k = _gain(e, past.now_y, following - state @ a.T - drive @ b.T)
    return values, a, b, c, d, k


def _input_matrices(
    a: Real, c: Real, data: list[Experiment], past: _Past, direct: bool
) -> tuple[Real, Real]:
    """Return B and D by least squares of the simulated output, with initial states eliminated."""
    n, m, p = len(a), past.n_in, past.n_out
    largest = float(np.max(np.abs(np.linalg.eigvals(a))))
    width = n * m + (p * m if direct else 0)
    factors = []
    for e in data:
        u, y = e.input / past.input_scale, e.output / past.output_scale
        # Rounding errors grow with an unstable A, so only its first samples are simulated.
        length = len(u)
        if largest > 1:
            length = int(min(length, max(4 * n, np.log(1e6) / np.log(largest))))
        r: Real = np.zeros((0, n + width + 1))
        start = np.eye(n, n + n * m)
        span = max(1, STATE_NUMBERS // start.size)
        for first in range(0, length, span):
            t = slice(first, min(first + span, length))
            rows, start = _simulated_columns(a, c, u[t], y[t], start, direct)
            (low,) = linalg.qr(np.vstack([r, rows]), mode="r", check_finite=False)
            r = np.asarray(low[: n + width + 1], np.float64)
        factors.append(r[n:, n:])
    both = np.vstack(factors)
    theta = _solve(both[:, :-1], both[:, -1:])[:, 0]
    b = theta[: n * m].reshape(m, n).T
    d = theta[n * m :].reshape(m, p).T if direct else np.zeros((p, m))
    return b, d


def _simulated_columns(
    a: Real, c: Real, u: Real, y: Real, start: Real, direct: bool
) -> tuple[Real, Real]:
    """Return the regressor of the simulated output, and the states after the last sample.

    Columns are the outputs due to each unit initial state, each entry of B and, if ``direct``, each
    entry of D; the last column is the measured output. Rows are samples by outputs. ``start`` holds
    the states at the first sample, for initial states and entries of B.
    """
    n, m, p = len(a), u.shape[1], y.shape[1]
    drive = np.zeros((len(u), n, n + n * m))
    # Entry (k, j) of B drives state k with input j.
    drive[:, :, n:] = (u[:, None, :, None] * np.eye(n)[:, None, :]).reshape(len(u), n, m * n)
    state = states(a, drive, start)
    blocks = [c @ state[:-1]]
    if direct:
        blocks.append((u[:, None, :, None] * np.eye(p)[:, None, :]).reshape(len(u), p, m * p))
    blocks.append(y[:, :, None])
    return np.concatenate(blocks, axis=2).reshape(len(u) * p, -1), state[-1]


def _solve(matrix: Real, target: Real) -> Real:
    """Return the least-squares solution of least norm.

    A past without noise has low rank; the solution of least norm then predicts as well as any other.
    """
    return np.asarray(np.linalg.lstsq(matrix, target, rcond=1e-12)[0])


def _innovations(model: StateSpaceModel, e: Experiment, skip: int) -> Real:
    if np.any(np.abs(np.linalg.eigvals(model.a - model.k @ model.c)) > 1):
        return np.full((1, model.c.shape[0]), np.nan)
    return (e.output - model.predict(e))[skip:]


def _one_step(model: StateSpaceModel, data: list[Experiment], skip: int) -> float:
    left = np.concatenate([_innovations(model, e, skip) for e in data])
    if np.isnan(left).any():
        return np.nan
    return float(np.linalg.det(left.T @ left / len(left)))


def _simulated(model: StateSpaceModel, data: list[Experiment], n_out: int) -> Real:
    if not data or not model.stable:
        return np.full(n_out, np.nan)
    pairs = [(e.output, model.simulate(e)) for e in data]
    return fit_percent(*(np.concatenate(x) for x in zip(*pairs, strict=True)))
