"""Optimal excitation: Fourier trajectories that determine rigid-body parameters well.

Criteria and parametrization follow Swevers et al. (1997) and Wernholt (2004), section 4.3. The
criterion is the condition number of the scaled base regressor, or ``-log det(Phi^T W Phi)``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.rigid_body.fourier import FourierTrajectory, series
from axisight.rigid_body.regressor import TorqueModel
from axisight.rigid_body.sensitivity import regressor_sensitivity
from axisight.robot.fixed_base import refuse_floating

Array = NDArray[np.float64]
Criterion = Literal["condition", "log_det"]
Status = Literal["converged", "max_iterations", "infeasible"]
QUANTITIES = ("position", "velocity", "acceleration", "torque")

_NORMS = (16.0, 64.0)
"""Exponents of the p-norms that replace a maximum; over n samples they exceed it by at most n^(1/p)."""
_TORQUE_RESERVE = 0.02
"""Allowance for torque peaks between the samples of the search, because torque has higher harmonics."""
_SMOOTHING = 0.02
"""Share of the velocity limit over which the search smooths the sign of the velocity."""
_ADVICE: dict[str, str] = {
    "converged": "",
    "max_iterations": "still improving: allow more iterations",
    "infeasible": (
        "no start ended within the limits: relax the margin that is above one, lower "
        "fundamental_hz or the number of harmonics, or check that gravity alone stays within "
        "the torque limit"
    ),
}


@summarized
@dataclass(frozen=True)
class MotionLimits:
    """Limits of a trajectory, joint side; one number for all axes or one per axis.

    position_rad
        (n_axes, 2), lower and upper [rad or m].
    velocity_rad_s, acceleration_rad_s2
        Largest absolute values.
    torque_nm
        Largest absolute values of the rows of the torque model, on the side of the model; None for no
        limit.
    """

    position_rad: ArrayLike
    velocity_rad_s: ArrayLike
    acceleration_rad_s2: ArrayLike
    torque_nm: ArrayLike | None = None


@summarized
@dataclass(frozen=True, eq=False)
class TrajectoryDesign:
    """The best trajectory of all starts.

    trajectory
        The motion; ``trajectory.write(path, robot, design=found.design)`` saves it.
    criterion
        ``"condition"`` or ``"log_det"``.
    before, after
        Criterion at the start and at the end, on a finer grid than that of the search and with the
        exact sign of the velocity.
    condition_before, condition_after
        Condition number of the scaled base regressor at the start and at the end.
    margins
        Peak over limit, over (``quantity``, ``axis``): above one exceeds the limit; NaN without
        a limit. Position counts from the middle of its range. Except for torque, peaks include a bound
        on values between samples.
    starts
        Over ``start``: ``before``, ``after``, ``feasible``, ``converged``, ``iterations``.
    status, advice
        Status of the best start: ``"converged"``, ``"max_iterations"`` or ``"infeasible"``.
    columns
        Positions of the base columns among the parameters of the model.
    design
        Settings and seed as plain numbers and text.
    """

    trajectory: FourierTrajectory
    criterion: Criterion
    before: float
    after: float
    condition_before: float
    condition_after: float
    margins: xr.DataArray
    starts: xr.Dataset
    status: Status
    advice: str
    columns: tuple[int, ...]
    design: dict[str, Any]


def optimize_trajectory(
    model: TorqueModel,
    limits: MotionLimits,
    *,
    fundamental_hz: float,
    harmonics: int = 5,
    criterion: Criterion = "condition",
    columns: ArrayLike | None = None,
    scale: ArrayLike | None = None,
    torque_std_nm: ArrayLike = 1.0,
    theta: ArrayLike | None = None,
    start_at_rest: bool = True,
    starts: int = 5,
    seed: int = 0,
    samples: int | None = None,
    max_iterations: int = 100,
) -> TrajectoryDesign:
    """Return a periodic trajectory that determines the base parameters well.

    Parameters
    ----------
    model : torque model to identify; elastic joints stand still.
    limits : limits of the trajectory.
    fundamental_hz : one over the period [Hz].
    harmonics : number of harmonics of every axis. Higher harmonics excite inertias more, but also
        flexibilities.
    criterion : ``"condition"``, the condition number of the scaled base regressor, or
        ``"log_det"``, ``-log det(Phi^T W Phi)`` per parameter.
    columns : base columns; by default those that pivoted QR finds independent.
    scale : prior sizes of the base parameters, which scale the columns for the condition
        number; by default columns have equal size over random motions.
    torque_std_nm : noise of the rows [Nm], one number or (n_rows,); W is its inverse square.
    theta : parameters that predict the torque, by default those of the robot.
    start_at_rest : whether velocity and acceleration are zero at t = 0.
    starts : number of random starts; start i is a function of (``seed``, i).
    seed : seed of the starts.
    samples : samples per period in the search, by default 20 per harmonic and at least 60.
    max_iterations : most iterations of SLSQP in each of its two rounds.

    Derivatives are exact. Only the search smooths Coulomb friction, over 2 % of the velocity limit.
    A trajectory that exceeds a limit is never reported as converged. Raises InputError naming the
    field.

    """
    problem = _Problem(
        model,
        _bounds(model, limits),
        _positive("fundamental_hz", fundamental_hz),
        _whole("harmonics", harmonics, 2 if start_at_rest else 1),
        _whole("samples", samples if samples is not None else max(60, 20 * harmonics), 8),
        start_at_rest,
    )
    if problem.samples < 4 * harmonics:
        raise InputError(f"samples: expected at least {4 * harmonics}, got {problem.samples}")
    if criterion not in ("condition", "log_det"):
        raise InputError(f'criterion: expected "condition" or "log_det", got {criterion!r}')
    values = model.nominal if theta is None else np.asarray(theta, dtype=np.float64)
    if values.shape != (model.n_parameters,) or not np.isfinite(values).all():
        raise InputError(
            f"theta: expected {model.n_parameters} finite numbers, got shape {values.shape}"
        )
    std = np.asarray(torque_std_nm, dtype=np.float64)
    if std.shape not in {(), (model.n_rows,)} or not (np.isfinite(std) & (std > 0)).all():
        raise InputError(f"torque_std_nm: expected one positive number or ({model.n_rows},)")
    problem.aim(criterion, columns, scale, np.broadcast_to(std, (model.n_rows,)), values, seed)
    iterations = _whole("max_iterations", max_iterations, 1)
    runs = [problem.run(seed, k, iterations) for k in range(_whole("starts", starts, 1))]
    # A feasible run is better than any infeasible one.
    best = min(range(len(runs)), key=lambda k: (not runs[k].feasible, runs[k].after))
    return problem.report(runs, best, seed)


@dataclass(frozen=True, eq=False)
class _Run:
    trajectory: FourierTrajectory
    before: float
    after: float
    condition_before: float
    condition_after: float
    margins: Array
    feasible: bool
    converged: bool
    iterations: int


class _Problem:
    """Criterion and limits over the free coefficients, with their gradients.

    Coefficients of an axis are ``[centre, sine, cosine]``. Those of all axes together are
    ``basis @ x``, which satisfies the conditions at t = 0 for every x.
    """

    def __init__(
        self,
        model: TorqueModel,
        bounds: dict[str, Array],
        fundamental_hz: float,
        harmonics: int,
        samples: int,
        at_rest: bool,
    ) -> None:
        self.model, self.bounds, self.harmonics = model, bounds, harmonics
        self.fundamental_hz, self.samples, self.at_rest = fundamental_hz, samples, at_rest
        robot = model.robot
        refuse_floating(robot, "optimize_trajectory")
        self.joints = np.array(robot.axis_joints)
        self.slowest = float(bounds["velocity"].min())
        gears = float(np.abs(model.coupling.position).max())
        terms = model.terms
        if terms.coulomb is not None and terms.smoothing_rad_s == 0.0:
            side = gears if "motor" in terms.sides("coulomb") else 1.0
            terms = replace(terms, smoothing_rad_s=_SMOOTHING * self.slowest * side)
        self.smooth = TorqueModel(robot, terms=terms, side=model.side, coupling=model.coupling)
        time = np.arange(samples) / (samples * fundamental_hz)
        self.series = tuple(
            np.hstack([np.full((samples, 1), float(k == 0)), matrix])
            for k, matrix in enumerate(series(fundamental_hz, harmonics, time))
        )
        self.basis = self._basis()
        # The peak of a trigonometric polynomial of degree h exceeds n samples by at most this factor.
        self.hidden = 1.0 / np.cos(np.pi * harmonics / samples)

    def _basis(self) -> Array:
        h, n = self.harmonics, len(self.joints)
        one = np.eye(1 + 2 * h)
        if self.at_rest:
            rest = np.zeros((2, 1 + 2 * h))
            rest[0, 1 : 1 + h] = 1.0
            rest[1, 1 + h :] = np.arange(1, h + 1)
            one = scipy.linalg.null_space(rest)
        # Velocities are relative to their limit, and centres to the range.
        out = np.zeros((n, 1 + 2 * h, n, one.shape[1]))
        for k in range(n):
            size = np.full(1 + 2 * h, self.bounds["velocity"][k])
            size[0] = self.bounds["half"][k]
            out[k, :, k] = size[:, None] * one
        return out.reshape(n * (1 + 2 * h), -1)

    def aim(
        self,
        criterion: Criterion,
        columns: ArrayLike | None,
        scale: ArrayLike | None,
        std: Array,
        theta: Array,
        seed: int,
    ) -> None:
        """Set criterion, base columns and scaling."""
        self.criterion, self.std, self.theta = criterion, std, theta
        rng = np.random.default_rng((seed, 1 << 32))
        shape = (20 * self.model.n_parameters, len(self.joints))
        middle, half = self.bounds["middle"], self.bounds["half"]
        phi = self.model.matrix(
            *self._all(
                middle + half * rng.uniform(-1, 1, shape),
                self.bounds["velocity"] * rng.uniform(-1, 1, shape),
                self.bounds["acceleration"] * rng.uniform(-1, 1, shape),
            )
        )
        flat = (phi / std[:, None]).reshape(-1, self.model.n_parameters)
        size = np.sqrt(np.mean(flat**2, axis=0))
        if columns is None:
            _, r, order = scipy.linalg.qr(
                flat / np.where(size > 0, size, 1.0), mode="economic", pivoting=True
            )
            rank = int(np.sum(np.abs(np.diag(r)) > 1e-10 * abs(r[0, 0])))
            self.columns = np.sort(order[:rank])
        else:
            chosen = np.asarray(columns)
            good = chosen.ndim == 1 and chosen.size and chosen.dtype.kind in "iu"
            if not good or chosen.min() < 0 or chosen.max() >= self.model.n_parameters:
                raise InputError(
                    f"columns: expected positions from 0 to {self.model.n_parameters - 1}"
                )
            self.columns = chosen.astype(np.int64)
        if scale is None:
            self.scale = 1.0 / np.where(size > 0, size, 1.0)[self.columns]
        else:
            given = np.asarray(scale, dtype=np.float64)
            if given.shape != self.columns.shape or not (np.isfinite(given) & (given > 0)).all():
                raise InputError(f"scale: expected {len(self.columns)} positive numbers")
            self.scale = given

    def _all(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Return the motions of all joints, with elastic joints at zero."""
        out = np.zeros((3, len(q), self.model.robot.n_joints))
        for full, part in zip(out, (q, v, a), strict=True):
            full[:, self.joints] = part
        return out[0], out[1], out[2]

    def motion(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the motion (samples, n_axes) of free coefficients x."""
        c = (self.basis @ x).reshape(len(self.joints), -1).T
        return self.series[0] @ c, self.series[1] @ c, self.series[2] @ c

    def pull(self, by_motion: list[Array]) -> Array:
        """Return the gradient over x from gradients over q, v, a, each (samples, n_axes)."""
        c = sum(m.T @ g for m, g in zip(self.series, by_motion, strict=True))
        return np.asarray(self.basis.T @ np.asarray(c).T.ravel())

    def value(self, phi: Array) -> tuple[float, Array]:
        """Return the criterion of the weighted, scaled base regressor (m, b), and its gradient."""
        u, s, vt = np.linalg.svd(phi, full_matrices=False)
        if s[-1] <= 1e-14 * s[0]:
            s = np.maximum(s, 1e-14 * s[0])
        if self.criterion == "condition":
            slope = np.outer(u[:, 0], vt[0]) / s[0] - np.outer(u[:, -1], vt[-1]) / s[-1]
            return float(np.log(s[0] / s[-1])), slope
        b = len(s)
        # phi includes the scale, so its determinant is subtracted.
        free = float(np.log(self.scale).sum()) * 2.0
        return (free - 2.0 * float(np.log(s).sum())) / b, (-2.0 / b) * ((u / s) @ vt)

    def evaluate(self, x: Array, norm: float) -> tuple[float, Array, Array, Array]:
        """Return criterion, gradient, limits ``1 - |.|_p`` (>= 0) and their Jacobian."""
        q, v, a = self.motion(x)
        s = regressor_sensitivity(self.smooth, *self._all(q, v, a))
        n, rows, b = len(q), self.model.n_rows, len(self.columns)
        weight = self.scale / self.std[:, None]
        cost, slope = self.value((s.value[..., self.columns] * weight).reshape(-1, b))
        inner = (slope.reshape(n, rows, b) * weight).astype(np.float64)
        parts = (s.position, s.velocity, s.acceleration)
        by_motion = [np.einsum("knrb,nrb->nk", d[..., self.columns], inner) for d in parts]
        gradient = self.pull(by_motion)
        values, jacobian = [], []
        for kind, signal in enumerate((q - self.bounds["middle"], v, a)):
            limit = self.bounds[("half", "velocity", "acceleration")[kind]]
            size, share = _p_norm(signal / limit * self.hidden, norm)
            for k in range(signal.shape[1]):
                by = [np.zeros_like(q) for _ in range(3)]
                by[kind][:, k] = -share[:, k] * self.hidden / limit[k]
                values.append(1.0 - size[k])
                jacobian.append(self.pull(by))
        if "torque" in self.bounds:
            limit = self.bounds["torque"] / (1.0 + _TORQUE_RESERVE)
            size, share = _p_norm((s.value @ self.theta) / limit, norm)
            slopes = [d @ self.theta for d in parts]
            for r in range(rows):
                by = [-(d[:, :, r] * share[:, r] / limit[r]).T for d in slopes]
                values.append(1.0 - size[r])
                jacobian.append(self.pull(by))
        return cost, gradient, np.array(values), np.array(jacobian)

    def run(self, seed: int, start: int, iterations: int) -> _Run:
        x = self.start(np.random.default_rng((seed, start)))
        first = x
        done, count = False, 0
        for norm in _NORMS:
            memory = _Memory(self, norm)
            constraint: Any = {"type": "ineq", "fun": memory.limits, "jac": memory.limits_slope}
            found = scipy.optimize.minimize(
                memory.cost,
                x,
                jac=memory.slope,
                method="SLSQP",
                constraints=constraint,
                options={"maxiter": iterations, "ftol": 1e-6},
            )
            x, done, count = np.array(found.x), bool(found.success), count + int(found.nit)
        before, condition_before, _ = self.check(first)
        after, condition_after, margins = self.check(x)
        return _Run(
            self.trajectory(x),
            before,
            after,
            condition_before,
            condition_after,
            margins,
            bool(np.nanmax(margins) <= 1.0 + 1e-6),
            done,
            count,
        )

    def start(self, rng: np.random.Generator) -> Array:
        """Return random coefficients, scaled together until they satisfy the limits."""
        n = len(self.joints)
        drawn = rng.normal(0.0, 1.0, self.basis.shape[1])
        coefficients = (self.basis @ drawn).reshape(n, -1)
        coefficients[:, 0] = self.bounds["middle"]
        x = np.linalg.lstsq(self.basis, coefficients.ravel(), rcond=None)[0]
        middle = np.zeros_like(coefficients)
        middle[:, 0] = self.bounds["middle"]
        rest = np.linalg.lstsq(self.basis, middle.ravel(), rcond=None)[0].astype(np.float64)
        size = 1.0
        for _ in range(30):
            if self.evaluate(rest + size * (x - rest), _NORMS[0])[2].min() >= 0.05:
                break
            size *= 0.8
        return np.asarray(rest + size * (x - rest))

    def trajectory(self, x: Array) -> FourierTrajectory:
        c = (self.basis @ x).reshape(len(self.joints), -1)
        h = self.harmonics
        return FourierTrajectory(
            self.fundamental_hz, c[:, 0].copy(), c[:, 1 : 1 + h].copy(), c[:, 1 + h :].copy()
        )

    def check(self, x: Array) -> tuple[float, float, Array]:
        """Return criterion and condition with the exact model on a fine grid, and the margins."""
        n = max(1000, 64 * self.harmonics)
        time = np.arange(n) / (n * self.fundamental_hz)
        q, v, a = self.trajectory(x).motion(time)
        phi = self.model.matrix(*self._all(q, v, a))
        # Scaled to as many samples as in the search, so that determinants are comparable.
        share = np.sqrt(self.samples / n)
        flat = (phi[..., self.columns] * (share * self.scale) / self.std[:, None]).reshape(
            -1, len(self.columns)
        )
        s = np.linalg.svd(flat, compute_uv=False)
        condition = float(s[0] / s[-1]) if s[-1] > 0 else float("inf")
        cost = condition if self.criterion == "condition" else self.value(flat)[0]
        hidden = 1.0 / np.cos(np.pi * self.harmonics / n)
        width = max(len(self.joints), self.model.n_rows)
        margins = np.full((4, width), np.nan)
        signals = (
            hidden * (q - self.bounds["middle"]) / self.bounds["half"],
            hidden * v / self.bounds["velocity"],
            hidden * a / self.bounds["acceleration"],
        )
        for row, signal in enumerate(signals):
            margins[row, : signal.shape[1]] = np.abs(signal).max(axis=0)
        if "torque" in self.bounds:
            torque = np.abs(phi @ self.theta / self.bounds["torque"]).max(axis=0)
            margins[3, : len(torque)] = torque
        return cost, condition, margins

    def report(self, runs: list[_Run], best: int, seed: int) -> TrajectoryDesign:
        run = runs[best]
        status: Status = "max_iterations"
        if not run.feasible:
            status = "infeasible"
        elif run.converged:
            status = "converged"
        fields = ("before", "after", "feasible", "converged", "iterations")
        table = xr.Dataset(
            {f: ("start", np.array([getattr(r, f) for r in runs])) for f in fields},
            attrs={"seed": seed, "criterion": self.criterion},
        )
        design = {
            "criterion": self.criterion,
            "before": run.before,
            "after": run.after,
            "condition": run.condition_after,
            "seed": seed,
            "start": best,
            "harmonics": self.harmonics,
            "samples": self.samples,
            "start_at_rest": self.at_rest,
            "limits": {k: v.tolist() for k, v in self.bounds.items()},
            "margins": dict(zip(QUANTITIES, np.nan_to_num(run.margins).tolist(), strict=True)),
        }
        width = run.margins.shape[1]
        return TrajectoryDesign(
            trajectory=run.trajectory,
            criterion=self.criterion,
            before=run.before,
            after=run.after,
            condition_before=run.condition_before,
            condition_after=run.condition_after,
            margins=xr.DataArray(
                run.margins,
                dims=("quantity", "axis"),
                coords={"quantity": list(QUANTITIES), "axis": list(range(1, width + 1))},
            ),
            starts=table,
            status=status,
            advice=_ADVICE[status],
            columns=tuple(int(c) for c in self.columns),
            design=design,
        )


class _Memory:
    """The last evaluation, kept because the optimiser requests value, gradient and limits separately."""

    def __init__(self, problem: _Problem, norm: float) -> None:
        self.problem, self.norm = problem, norm
        self.key = b""
        self.found: tuple[float, Array, Array, Array] | None = None

    def at(self, x: Array) -> tuple[float, Array, Array, Array]:
        key = x.tobytes()
        if self.found is None or key != self.key:
            self.key, self.found = key, self.problem.evaluate(x, self.norm)
        return self.found

    def cost(self, x: Array) -> float:
        return self.at(x)[0]

    def slope(self, x: Array) -> Array:
        return self.at(x)[1]

    def limits(self, x: Array) -> Array:
        return self.at(x)[2]

    def limits_slope(self, x: Array) -> Array:
        return self.at(x)[3]


def _p_norm(x: Array, norm: float) -> tuple[Array, Array]:
    """Return p-norms of the columns, which bound the largest absolute values, and derivatives."""
    top = np.maximum(np.abs(x).max(axis=0), 1e-300)
    size = top * np.sum((np.abs(x) / top) ** norm, axis=0) ** (1.0 / norm)
    return size, np.sign(x) * (np.abs(x) / size) ** (norm - 1.0)


def _bounds(model: TorqueModel, limits: MotionLimits) -> dict[str, Array]:
    n = model.robot.n_axes
    position = np.asarray(limits.position_rad, dtype=np.float64)
    if position.shape != (n, 2) or not np.isfinite(position).all():
        raise InputError(f"position_rad: expected finite shape ({n}, 2), got {position.shape}")
    if np.any(position[:, 1] <= position[:, 0]):
        raise InputError("position_rad: expected upper above lower limits")
    out = {"middle": position.mean(axis=1), "half": 0.5 * (position[:, 1] - position[:, 0])}
    for key, field, width in (
        ("velocity", "velocity_rad_s", n),
        ("acceleration", "acceleration_rad_s2", n),
        ("torque", "torque_nm", model.n_rows),
    ):
        given = getattr(limits, field)
        if given is None and key == "torque":
            continue
        value = np.asarray(np.nan if given is None else given, dtype=np.float64)
        if value.shape not in {(), (width,)} or not (np.isfinite(value) & (value > 0)).all():
            raise InputError(f"{field}: expected positive numbers, one or ({width},)")
        out[key] = np.broadcast_to(value, (width,)).copy()
    return out


def _positive(field: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{field}: expected a positive number, got {value!r}")
    return float(value)


def _whole(field: str, value: int, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{field}: expected a whole number from {least}, got {value!r}")
    return int(value)
