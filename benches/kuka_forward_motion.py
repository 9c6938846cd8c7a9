"""The motion that explains measured torques best, among motions like those of the training recordings.

The training motions of all axes and recordings are combinations of 13 shapes over time to 3 % of their size, of 14
to 0.3 % and of 15 to 0.1 %. A motion is six combinations of these shapes. The prior is normal, with the mean and
the covariance of the training motions. The torque error has a tail, and is larger where an axis is slow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from kuka_forward_physics import Physics, measured
from numpy.typing import NDArray

SHAPES = 16
"""Shapes of a motion: one more than the 15, as the repeats begin up to 0.2 s earlier or later."""
TAIL = 10.0
"""Degrees of freedom of the torque error."""
SLOW_RAD_S = 0.008
"""Speed below which friction is less certain."""
INFLATION = 2.0
"""Torque errors count this many times larger, because they are alike over about 2 s."""
SOFT_RAD_S = 0.005
"""Dry friction reverses over this speed, which keeps the cost smooth."""

Array = NDArray[np.float64]
Coefficients = NDArray[np.float64]


@dataclass(frozen=True)
class MotionPrior:
    """Shapes and their first two derivatives (3, n, k), and of each axis mean (6, k) and covariance (6, k, k)."""

    shapes: Array
    mean: Array
    covariance: Array

    @classmethod
    def of(cls, positions: Array, step_s: float) -> MotionPrior:
        """Return the prior of training motions (m, n, 6) [rad]."""
        size = positions.std(axis=(0, 1))
        flat = (positions / size).transpose(0, 2, 1).reshape(-1, positions.shape[1])
        shapes = np.linalg.svd(flat, full_matrices=False)[2][:SHAPES].T
        found = np.einsum("tk,mti->mik", shapes, positions)
        mean = found.mean(axis=0)
        # One covariance for all axes, which differ in size only.
        apart = ((found - mean) / size[:, None]).reshape(-1, SHAPES)
        shared = apart.T @ apart / len(apart)
        shared += 1e-6 * np.trace(shared) / SHAPES * np.eye(SHAPES)
        velocity = np.gradient(shapes, step_s, axis=0)
        acceleration = np.gradient(velocity, step_s, axis=0)
        return cls(
            np.stack([shapes, velocity, acceleration]), mean, size[:, None, None] ** 2 * shared
        )

    @property
    def size_rad(self) -> Array:
        """Standard deviation of the position of each axis (6,), over time."""
        return np.sqrt(np.trace(self.covariance, axis1=1, axis2=2) / self.shapes.shape[1])

    def draw(self, rng: np.random.Generator) -> Coefficients:
        """Return the coefficients (k, 6) of a random motion."""
        noise = rng.normal(size=self.mean.shape)
        root = np.linalg.cholesky(self.covariance)
        return (self.mean + np.einsum("ikl,il->ik", root, noise)).T

    def motion(self, c: Coefficients) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration (n, 6) of coefficients."""
        q, v, a = self.shapes @ c
        return q, v, a


def error_scale(error_nm: Array, v: Array) -> Array:
    """Return the torque error (n, 6) [Nm] at speeds; ``error_nm`` (2, 6) holds fast and slow axes."""
    return np.asarray(error_nm[0] + (error_nm[1] - error_nm[0]) * np.exp(-np.abs(v) / SLOW_RAD_S))


class MotionEstimator:
    """Finds the motion of one stretch between two rests from its torques."""

    def __init__(
        self, physics: Physics, error_nm: Array, prior: MotionPrior, used: NDArray[np.bool_]
    ) -> None:
        self.physics, self.error_nm, self.prior, self.used = physics, error_nm, prior, used
        self.whiten = np.linalg.inv(np.linalg.cholesky(prior.covariance))
        self.aim = np.einsum("ikl,il->ik", self.whiten, prior.mean)

    def position(self, c: Coefficients) -> Array:
        """Return positions (n, 6) of coefficients."""
        return self.prior.motion(c)[0]

    def coefficients(self, position_rad: Array) -> Coefficients:
        """Return the coefficients closest to positions."""
        return self.prior.shapes[0].T @ position_rad

    def started(self, q: Array, v: Array, share: float) -> Coefficients:
        """Return coefficients from rough positions and velocities, with errors of a share of the prior's size."""
        b, out = self.prior.shapes, []
        sizes = self.prior.size_rad
        speeds = sizes * np.sqrt((b[1] ** 2).sum() / (b[0] ** 2).sum())
        for i in range(6):
            x = np.concatenate(
                [self.whiten[i], b[0] / (share * sizes[i]), b[1] / (share * speeds[i])]
            )
            y = np.concatenate(
                [self.aim[i], q[:, i] / (share * sizes[i]), v[:, i] / (share * speeds[i])]
            )
            out.append(np.linalg.lstsq(x, y, rcond=None)[0])
        return np.stack(out, axis=1)

    def cost(
        self, u: Array, c: Coefficients, soft: float = SOFT_RAD_S, inflate: float = INFLATION
    ) -> tuple[float, Array]:
        """Return twice the negative log posterior, and the torque errors over their scale."""
        q, v, a = self.prior.motion(c)
        scale = error_scale(self.error_nm, v)
        e = (u - measured(self.physics.torque(q, v, a, soft))) / scale / inflate
        prior = ((np.einsum("ikl,li->ik", self.whiten, c) - self.aim) ** 2).sum()
        tail = (TAIL + 1) * np.log1p(e**2 / TAIL) + 2 * np.log(scale / self.error_nm[0])
        return float(tail[self.used].sum() + prior), e

    def improve(
        self, u: Array, c: Coefficients, soft: float, inflate: float, steps: int
    ) -> tuple[float, Coefficients]:
        """Return cost and coefficients after damped Gauss-Newton steps."""
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
        return cost, c

    def _equations(
        self, c: Coefficients, e: Array, soft: float, inflate: float
    ) -> tuple[Array, Array]:
        b = self.prior.shapes
        q, v, a = self.prior.motion(c)
        _, d = self.physics.jacobian(q, v, a, soft)
        weight = np.sqrt((TAIL + 1) / (TAIL + e**2)) * self.used[:, None]
        k, scale = len(c), error_scale(self.error_nm, v) * inflate
        normal, right = np.zeros((6 * k, 6 * k)), np.zeros(6 * k)
        for i in range(6):
            x = sum(d[j, :, i, :, None] * b[j][:, None, :] for j in range(3)).reshape(len(e), -1)
            x = measured(x) * (weight[:, i] / scale[:, i])[:, None]
            normal += x.T @ x
            right += x.T @ (weight[:, i] * e[:, i])
            at, w = slice(i * k, (i + 1) * k), self.whiten[i]
            normal[at, at] += w.T @ w
            right[at] += w.T @ (self.aim[i] - w @ c[:, i])
        return normal, right
