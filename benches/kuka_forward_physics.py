"""The torque equation of the robot: links, rotors, offsets and friction, identified by least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from axisight.rigid_body import TorqueModel

WIDTHS_RAD_S = np.array([0.0004, 0.004, 0.02, 0.1, 0.4])
"""Speeds at which the parts of the friction curve saturate."""
TAPS = np.array([0.236, 0.347, 0.307, 0.110])
"""Low-pass of the torque channel: weights of the torque 0, 0.1, 0.2 and 0.3 s ago, fitted to training."""
RIDGE = 1e-7

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
