"""A robot's torque equation, and the motion that explains measured torques best.

The motion is a spline with knots every 2 s, which holds the training motions to 0.5 % of their size.
Its prior is a stationary process whose position, velocity
and acceleration have the standard deviations of the training motions.
The torque error is a first-order process with a heavy tail.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.signal import lfilter

from axisight.rigid_body import TorqueModel

WIDTHS_RAD_S = np.array([0.0004, 0.004, 0.02, 0.1, 0.4])
"""Speeds at which the parts of the friction curve saturate."""
TAPS = np.array([0.236, 0.347, 0.307, 0.110])
"""Low-pass of the torque channel: weights of the torque 0, 0.1, 0.2 and 0.3 s ago, fitted to training."""
CORRELATION_S = 2.0
"""Time over which the torque error of the training recordings decorrelates."""
TAIL = 3.0
"""Degrees of freedom of the heavy-tailed torque error."""
SLOW_RAD_S = 0.008
"""Speed below which friction is less certain."""
KNOT, DEGREE = 20, 4
RIDGE = 1e-7
AT_REST = 1e3

Array = NDArray[np.float64]


def motion(position_rad: Array, step_s: float) -> tuple[Array, Array, Array]:
    """Return position, velocity and acceleration (n, 6) by central differences; the motions are slow."""
    velocity = np.gradient(position_rad, step_s, axis=0)
    return position_rad, velocity, np.gradient(velocity, step_s, axis=0)


@dataclass(frozen=True)
class Physics:
    """Motor torques of rigid links, rotors, offsets and a friction curve of each axis."""

    model: TorqueModel
    links: Array
    friction: Array

    def torque(self, q: Array, v: Array, a: Array, soft: float = 0.0) -> Array:
        """Return motor torques (n, 6) [Nm]; ``soft`` [rad/s] widens the steps of dry friction."""
        return self.model.matrix(q, v, a, threads=1) @ self.links + np.einsum(
            "nib,ib->ni", curves(v, soft), self.friction
        )

    def jacobian(self, q: Array, v: Array, a: Array, soft: float = 0.0) -> tuple[Array, Array]:
        """Return torques and derivatives (3, n, 6, 6) with respect to position, velocity and acceleration."""

        n, unit, none = len(q), np.eye(6), np.zeros((6, 6))
        steps = (
            np.concatenate([np.zeros((1, 6)), 1e-5 * unit, none, none]),
            np.concatenate([np.zeros((1, 6)), none, 1e-5 * unit, none]),
            np.concatenate([np.zeros((1, 6)), none, none, unit]),
        )
        moved = [
            (x[None] + step[:, None]).reshape(-1, 6)
            for x, step in zip((q, v, a), steps, strict=True)
        ]
        rigid = (self.model.matrix(*moved, threads=1) @ self.links).reshape(19, n, 6)
        at = rigid[0]
        size = np.array([1e-5, 1e-5, 1.0])[:, None, None, None]
        out = np.moveaxis((rigid[1:] - at).reshape(3, 6, n, 6), 1, 3) / size
        own = np.einsum("nib,ib->ni", slopes(v, soft), self.friction)
        out[1, :, range(6), range(6)] += own.T
        return at + np.einsum("nib,ib->ni", curves(v, soft), self.friction), out


def curves(v: Array, soft: float = 0.0) -> Array:
    """Return the parts of the friction curve (n, 6, parts): saturating ones, then the speed."""
    width = np.hypot(WIDTHS_RAD_S, soft)
    return np.concatenate([np.tanh(v[..., None] / width), v[..., None]], axis=-1)


def slopes(v: Array, soft: float = 0.0) -> Array:
    """Return derivatives of :func:`curves`."""
    width = np.hypot(WIDTHS_RAD_S, soft)
    steep = (1 - np.tanh(v[..., None] / width) ** 2) / width
    return np.concatenate([steep, np.ones((*v.shape, 1))], axis=-1)


def measured(torque: Array) -> Array:
    """Return a torque (n, ...) as the torque channel shows it; before the first sample it held still."""
    padded = np.concatenate([np.repeat(torque[:1], len(TAPS) - 1, axis=0), torque])
    return np.asarray(lfilter(TAPS, 1.0, padded, axis=0)[len(TAPS) - 1 :])


def identify(
    model: TorqueModel,
    records: Sequence[tuple[Array, Array]],
    used: NDArray[np.bool_],
    step_s: float,
) -> tuple[Physics, Array]:
    """Return physics by weighted least squares from (torque, position), and its rms errors (6,) [Nm]."""
    n_links = model.n_parameters
    weight = np.ones(6)
    for _ in range(2):
        normal, right, squares, count = 0.0, 0.0, np.zeros(6), 0
        kept = []
        for torque, position in records:
            q, v, a = motion(position, step_s)
            parts = curves(v)
            rows = np.zeros((len(q), 6, n_links + parts[0].size))
            rows[:, :, :n_links] = model.matrix(q, v, a, threads=1)
            for i in range(6):
                at = n_links + i * parts.shape[2]
                rows[:, i, at : at + parts.shape[2]] = parts[:, i]
            take = used[: len(q)]
            x, y = measured(rows)[take] / weight[:, None], torque[take] / weight
            flat = x.reshape(-1, x.shape[2])
            normal, right = normal + flat.T @ flat, right + flat.T @ y.ravel()
            kept.append((flat, y))
        size = np.sqrt(np.diag(normal))
        size[size == 0] = 1.0
        scaled = normal / np.outer(size, size) + RIDGE * np.eye(len(size))
        theta = np.linalg.solve(scaled, right / size) / size
        for flat, y in kept:
            error = (y - (flat @ theta).reshape(-1, 6)) * weight
            squares, count = squares + (error**2).sum(axis=0), count + len(error)
        weight = np.sqrt(squares / count)
    return Physics(model, theta[:n_links], theta[n_links:].reshape(6, -1)), weight


def spread(positions: Sequence[Array], step_s: float) -> Array:
    """Return mean position and standard deviations of position, velocity, acceleration, shape (4, 6)."""
    q, v, a = (np.concatenate(x) for x in zip(*(motion(p, step_s) for p in positions), strict=True))
    return np.stack([q.mean(axis=0), q.std(axis=0), v.std(axis=0), a.std(axis=0)])


class MotionEstimator:
    """Finds the motion of one stretch between two rests from its torques."""

    def __init__(
        self,
        physics: Physics,
        error_nm: Array,
        prior: Array,
        rest: NDArray[np.bool_],
        used: NDArray[np.bool_],
        step_s: float,
    ) -> None:
        self.physics, self.used = physics, used
        n = len(rest)
        self.basis = splines(n, step_s)
        fall = np.exp(-step_s / CORRELATION_S)
        self.whiten = np.array([1.0, -fall])
        self.scale = error_nm * np.sqrt(1 - fall**2)  # (2, 6): fast, slow
        b = self.basis
        self.rows, self.aim = [], []
        for mean, sq, sv, sa in prior.T:
            # The process q''' + q'' + c1 q' + c0 q = noise with these stationary variances.
            c1, c0 = sa**2 / sv**2, sv**2 / sq**2
            k = np.sqrt(step_s / (2 * (sa**2 - sv**4 / sq**2)))
            still = np.concatenate([b[0][rest], b[1][rest]]) * AT_REST
            self.rows.append(np.concatenate([k * (b[3] + b[2] + c1 * b[1] + c0 * b[0]), still]))
            self.aim.append(np.concatenate([np.full(n, k * c0 * mean), np.zeros(len(still))]))

    def position(self, c: Array) -> Array:
        """Return positions (n, 6) of coefficients."""
        return self.basis[0] @ c

    def coefficients(self, position_rad: Array) -> Array:
        """Return the coefficients closest to positions."""
        return np.asarray(np.linalg.lstsq(self.basis[0], position_rad, rcond=None)[0])

    def started(self, q: Array, v: Array, q_std: Array, v_std: Array) -> Array:
        """Return the coefficients that fit rough positions and velocities with these errors, and the prior."""
        out = []
        for i in range(6):
            x = np.concatenate([self.rows[i], self.basis[0] / q_std[i], self.basis[1] / v_std[i]])
            y = np.concatenate([self.aim[i], q[:, i] / q_std[i], v[:, i] / v_std[i]])
            out.append(np.linalg.lstsq(x, y, rcond=None)[0])
        return np.stack(out, axis=1)

    def scales(self, v: Array) -> Array:
        """Return the scale (n, 6) of whitened torque errors, larger where an axis is slow."""
        return self.scale[0] + (self.scale[1] - self.scale[0]) * np.exp(-np.abs(v) / SLOW_RAD_S)

    def cost(self, u: Array, c: Array, soft: float, inflate: float) -> tuple[float, Array]:
        """Return twice the negative log posterior, and the whitened errors."""
        q, v, a = (b @ c for b in self.basis[:3])
        scale = self.scales(v)
        torque = self.physics.torque(q, v, a, soft)
        e = np.asarray(lfilter(self.whiten, 1.0, u - measured(torque), axis=0)) / scale / inflate
        prior = sum(
            ((x @ c[:, i] - y) ** 2).sum()
            for i, (x, y) in enumerate(zip(self.rows, self.aim, strict=True))
        )
        return float(
            ((TAIL + 1) * np.log1p(e**2 / TAIL) + 2 * np.log(scale / self.scale[0]))[
                self.used
            ].sum()
            + prior
        ), e

    def improve(
        self, u: Array, c: Array, soft: float, inflate: float, steps: int
    ) -> tuple[Array, float]:
        """Return coefficients after damped Gauss-Newton steps, and their cost."""
        damping = 1e-5
        cost, e = self.cost(u, c, soft, inflate)
        for _ in range(steps):
            normal, right = self._equations(c, e, soft, inflate)
            better = False
            for _ in range(6):
                step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), right)
                trial = c + step.reshape(6, -1).T
                value, errors = self.cost(u, trial, soft, inflate)
                if value < cost:
                    better = True
                    break
                damping = max(10 * damping, 1e-4)
            if not better:
                break
            gain, c, cost, e = cost - value, trial, value, errors
            damping = max(damping / 10, 1e-9)
            if gain < 1e-4 * cost:
                break
        return c, cost

    def _equations(self, c: Array, e: Array, soft: float, inflate: float) -> tuple[Array, Array]:
        b = self.basis
        _, d = self.physics.jacobian(b[0] @ c, b[1] @ c, b[2] @ c, soft)
        weight = np.sqrt((TAIL + 1) / (TAIL + e**2)) * self.used[:, None]
        n_c, scale = len(c), self.scales(b[1] @ c)
        normal, right = np.zeros((6 * n_c, 6 * n_c)), np.zeros(6 * n_c)
        for i in range(6):
            x = sum(d[k, :, i, :, None] * b[k][:, None, :] for k in range(3)).reshape(len(e), -1)
            x = (
                lfilter(self.whiten, 1.0, measured(x), axis=0)
                * (weight[:, i] / scale[:, i] / inflate)[:, None]
            )
            normal += x.T @ x
            right += x.T @ (weight[:, i] * e[:, i])
            at = slice(i * n_c, (i + 1) * n_c)
            normal[at, at] += self.rows[i].T @ self.rows[i]
            right[at] += self.rows[i].T @ (self.aim[i] - self.rows[i] @ c[:, i])
        return normal, right


def splines(n: int, step_s: float) -> list[Array]:
    """Return values and three derivatives of the spline basis at ``n`` samples."""
    pieces = int(np.ceil((n - 1) / KNOT))
    knots = np.arange(-DEGREE, pieces + DEGREE + 1) * KNOT * step_s
    basis = BSpline(knots, np.eye(pieces + DEGREE), DEGREE)
    time = np.minimum(np.arange(n) * step_s, pieces * KNOT * step_s - 1e-9)
    return [basis(time), *(basis.derivative(k)(time) for k in (1, 2, 3))]


def simulated(physics: Physics, u: Array, rest: NDArray[np.bool_], step_s: float) -> Array:
    """Return positions (n, 6) simulated forward by implicit Euler steps, set to zero at rest; causal.

    The torque channel is late by its mean delay, over which the last speed extrapolates.
    """
    delay_s = step_s * float(TAPS @ np.arange(len(TAPS)))
    q, v, a = np.zeros((3, 6))
    out = np.zeros_like(u)
    for k in range(1, len(u)):
        if rest[k]:
            q, v, a = np.zeros((3, 6))
        else:
            for _ in range(4):
                v_new = v + step_s * a
                now = [x[None] for x in (q + step_s * v_new, v_new, a)]
                torque, d = physics.jacobian(now[0], now[1], now[2], 0.05)
                slope = d[2, 0] + step_s * d[1, 0] + step_s**2 * d[0, 0]
                a = a + np.clip(np.linalg.solve(slope, u[k] - torque[0]), -2.0, 2.0)
            v = v + step_s * a
            q = q + step_s * v
        out[k] = q + delay_s * v
    return out
