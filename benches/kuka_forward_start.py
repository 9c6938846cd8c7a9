"""A rough motion from torques, as a start for the search: a network from the torques within 10 s to the motion.

It learns from the training motions and from random motions of the same prior, whose torques the identified physics
give, with errors of friction and torque as large as those of the training recordings.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from kuka_forward_motion import MotionPrior, error_scale
from kuka_forward_physics import Physics, measured, motion
from numpy.typing import NDArray
from scipy.signal import lfilter
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

LAGS = np.array([1, 2, 3, 4, 5, 6, 7, 9, 11, 14, 17, 21, 26, 32, 40, 50, 65, 80, 100])
"""Distances in samples to the torques that the network sees, on both sides."""
FADE = 60.0
LAYERS, BATCH, PORTION, RATE = (256, 256), 256, 100, 1e-3
FRICTION_ERROR = 0.12
"""Random error of each part of the friction: that of axis 1 falls by 20 % over the training recordings."""
CORRELATION_S = 2.0
"""Time over which the torque error of the training recordings decorrelates."""
MEASURED_SHARE = 0.1
"""Share of measured motions among those that the network learns from."""

Array = NDArray[np.float64]


class Recognition:
    """A network from torques to position and velocity, trained on ``count`` motions."""

    def __init__(
        self,
        stretches: Sequence[tuple[Array, Array]],
        physics: Physics,
        prior: MotionPrior,
        error_nm: Array,
        used: NDArray[np.bool_],
        step_s: float,
        *,
        count: int,
        seed: int,
    ) -> None:
        self.stretches, self.physics, self.prior = stretches, physics, prior
        self.error_nm, self.used, self.step_s = error_nm, used, step_s
        torques = np.concatenate([u for u, _ in stretches])
        self.center, self.size = torques.mean(axis=0), torques.std(axis=0)
        known = np.concatenate([self._aims(q) for _, q in stretches])
        self.mean, self.spread = known.mean(axis=0), known.std(axis=0)
        self.net = MLPRegressor(
            hidden_layer_sizes=LAYERS,
            batch_size=BATCH,
            max_iter=1,
            warm_start=True,
            random_state=seed,
            alpha=1e-6,
        )
        rng = np.random.default_rng(seed)
        for done in range(0, count, PORTION):
            self._learn(rng, RATE * np.cos(0.5 * np.pi * done / count))

    def __call__(self, u: Array) -> tuple[Array, Array]:
        """Return rough positions and velocities (n, 6)."""
        both = self.net.predict(self._features(u)) * self.spread + self.mean
        return both[:, :6], both[:, 6:]

    def _learn(self, rng: np.random.Generator, rate: float) -> None:
        x, y = [], []
        for _ in range(PORTION):
            u, q = (
                self.stretches[rng.integers(len(self.stretches))]
                if rng.random() < MEASURED_SHARE
                else self._drawn(rng)
            )
            x.append(self._features(u)[self.used])
            y.append((self._aims(q) - self.mean) / self.spread)
        self.net.set_params(learning_rate_init=rate)
        with warnings.catch_warnings():
            # One pass over each portion is meant.
            warnings.simplefilter("ignore", ConvergenceWarning)
            self.net.fit(np.concatenate(x), np.concatenate(y).astype(np.float32))

    def _aims(self, q: Array) -> Array:
        return np.concatenate(motion(q, self.step_s)[:2], axis=1)[self.used]

    def _features(self, u: Array) -> NDArray[np.float32]:
        lags = np.concatenate([-LAGS[::-1], [0], LAGS])
        scaled = (u - self.center) / self.size
        at = np.clip(np.arange(len(u))[:, None] + lags, 0, len(u) - 1)
        x = (scaled[at] * np.exp(-np.abs(lags) / FADE)[:, None]).reshape(len(u), -1)
        time = np.linspace(-1, 1, len(u))[:, None]
        return np.concatenate([x, time, time**2, np.abs(time)], axis=1).astype(np.float32)

    def _drawn(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return torque and position of a random motion."""
        q, v, a = self.prior.motion(self.prior.draw(rng))
        friction = self.physics.friction
        errors = 1 + FRICTION_ERROR * rng.normal(size=friction.shape)
        physics = replace(self.physics, friction=friction * errors)
        fall = np.exp(-self.step_s / CORRELATION_S)
        noise = rng.standard_t(3, size=q.shape) * np.sqrt((1 - fall**2) / 3)
        error = lfilter([1.0], [1.0, -fall], noise * error_scale(self.error_nm, v), axis=0)
        return measured(physics.torque(q, v, a)) + rng.uniform(0.5, 1.5) * error, q
