"""A rough motion from torques, as a start for the estimate of the motion: a regression on random features.

It is trained on the training motions and on mixtures of them, whose torques the identified physics give.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from kuka_forward_map import CORRELATION_S, Physics, measured, motion
from numpy.typing import NDArray
from scipy.signal import lfilter

LAGS = np.array([2, 3, 4, 5, 6, 7, 9, 11, 14, 17, 21, 26, 32, 40, 50])
"""Distances in samples to the torques that the regression sees, on both sides, beside 0 and 1."""
FADE = 30.0
MIRRORED = (0, 3, 4, 5)
"""Axes whose training motions are about symmetric; mixtures mirror them at random."""
FEATURES, FEATURE_SCALE, RIDGE, MIXTURES = 500, 0.1, 100.0, 60

Array = NDArray[np.float64]


class Recognition:
    """Random-feature regression from the torques within 5 s to position and velocity."""

    def __init__(
        self,
        stretches: Sequence[tuple[Array, Array]],
        physics: Physics,
        error_nm: Array,
        used: NDArray[np.bool_],
        step_s: float,
        seed: int,
    ) -> None:
        rng = np.random.default_rng(seed)
        torques = np.concatenate([u for u, _ in stretches])
        self.center, self.size = torques.mean(axis=0), torques.std(axis=0)
        lags = np.concatenate([-LAGS[::-1], [-1, 0, 1], LAGS])
        self.lags, self.fade = lags, np.exp(-np.abs(lags) / FADE)
        self.weights = FEATURE_SCALE * rng.normal(size=(6 * len(lags), FEATURES))
        self.shift = rng.uniform(-1, 1, FEATURES)
        mixed = [self._mixture(rng, stretches, physics, error_nm, step_s) for _ in range(MIXTURES)]
        normal, right = 0.0, 0.0
        for u, position in [*stretches, *mixed]:
            q, v, _ = motion(position, step_s)
            x = self._features(u)[used]
            normal = normal + x.T @ x
            right = right + x.T @ np.concatenate([q, v], axis=1)[used]
        self.coefficients = np.linalg.solve(normal + RIDGE * np.eye(len(normal)), right)

    def __call__(self, u: Array) -> tuple[Array, Array]:
        """Return rough positions and velocities (n, 6)."""
        both = self._features(u) @ self.coefficients
        return both[:, :6], both[:, 6:]

    def _features(self, u: Array) -> Array:
        scaled = (u - self.center) / self.size
        at = np.clip(np.arange(len(u))[:, None] + self.lags, 0, len(u) - 1)
        x = (scaled[at] * self.fade[:, None]).reshape(len(u), -1)
        return np.concatenate(
            [np.tanh(x @ self.weights + self.shift), x, np.ones((len(u), 1))], axis=1
        )

    @staticmethod
    def _mixture(
        rng: np.random.Generator,
        stretches: Sequence[tuple[Array, Array]],
        physics: Physics,
        error_nm: Array,
        step_s: float,
    ) -> tuple[Array, Array]:
        """Return torque and position of a motion whose axes come from different training motions."""
        position = np.empty_like(stretches[0][1])
        for axis in range(6):
            one = stretches[rng.integers(len(stretches))][1][:, axis]
            one = one[::-1] if rng.random() < 0.5 else one
            sign = -1.0 if axis in MIRRORED and rng.random() < 0.5 else 1.0
            position[:, axis] = sign * rng.uniform(0.85, 1.1) * one
        fall = np.exp(-step_s / CORRELATION_S)
        noise = rng.normal(size=position.shape) * np.sqrt(1 - fall**2)
        error = lfilter([1.0], [1.0, -fall], noise, axis=0) * error_nm
        return measured(physics.torque(*motion(position, step_s))) + error, position
