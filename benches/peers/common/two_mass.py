"""The two-mass axis of Wernholt (2004), (9.9), for the peers: numba and SciPy, nothing of ours.

Records come from a closed loop (PI velocity controller at 2 kHz, torque held), the plant
integrated with many Runge-Kutta steps per sample. The peer fits with one step per sample, as a
mex-file for NLGREY would; its derivatives are finite differences, as SciPy takes them, or the
variational equations written out by hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.optimize import least_squares

import axisight.excitation as ex

Array = np.ndarray
NAMES = ("J_m", "J_a", "k1", "k3", "d", "F_v", "F_c")
RATIO = 1 / 224.3
SAMPLE_S = 5e-4
# Table 9.1: model m3, and the initial model m0.
TRUTH = np.array([0.0121, 1130.0, 1.46e6, 3.72e10, 2630.0, 0.013, 0.644])
START = np.array([0.0123, 790.0, 0.814e6, 5.4e10, 0.0, 0.0136, 0.642])
KP, KI = 1.0, 20.0
# Runge-Kutta steps per sample of the records.
CRUMBS = 64


@numba.njit(error_model="numpy")
def _rate(x1, x2, x3, u, p, r):
    rate = r * x2 - x3
    spring = p[2] * x1 + p[3] * x1 * x1 * x1 + p[4] * rate
    return rate, (u - p[5] * x2 - p[6] * np.sign(x2) - r * spring) / p[0], spring / p[1]


@numba.njit(error_model="numpy")
def _step(x1, x2, x3, u, p, r, h):
    a1, a2, a3 = _rate(x1, x2, x3, u, p, r)
    b1, b2, b3 = _rate(x1 + 0.5 * h * a1, x2 + 0.5 * h * a2, x3 + 0.5 * h * a3, u, p, r)
    c1, c2, c3 = _rate(x1 + 0.5 * h * b1, x2 + 0.5 * h * b2, x3 + 0.5 * h * b3, u, p, r)
    d1, d2, d3 = _rate(x1 + h * c1, x2 + h * c2, x3 + h * c3, u, p, r)
    s = h / 6.0
    return (
        x1 + s * (a1 + 2.0 * (b1 + c1) + d1),
        x2 + s * (a2 + 2.0 * (b2 + c2) + d2),
        x3 + s * (a3 + 2.0 * (b3 + c3) + d3),
    )


@numba.njit(error_model="numpy")
def simulate(p, u, r, h, out):
    """Motor velocity under a held torque, one step per sample."""
    x1, x2, x3 = 0.0, 0.0, 0.0
    for k in range(u.size):
        out[k] = x2
        x1, x2, x3 = _step(x1, x2, x3, u[k], p, r, h)


@numba.njit(error_model="numpy")
def closed_loop(p, reference, r, h, kp, ki, crumbs, u, y):
    """PI velocity loop; ``y`` is the motor velocity at the samples."""
    x1, x2, x3, integral = 0.0, 0.0, 0.0, 0.0
    for k in range(reference.size):
        y[k] = x2
        error = reference[k] - y[k]
        u[k] = kp * error + ki * integral
        integral += h * error
        for _ in range(crumbs):
            x1, x2, x3 = _step(x1, x2, x3, u[k], p, r, h / crumbs)


@numba.njit(error_model="numpy")
def _variation(x1, x2, x3, s, u, p, r, f, ds):
    """State rate into ``f`` and rate of the 3 x 7 sensitivities into ``ds``."""
    rate = r * x2 - x3
    cube = x1 * x1 * x1
    spring = p[2] * x1 + p[3] * cube + p[4] * rate
    sign = np.sign(x2)
    f[0] = rate
    f[1] = (u - p[5] * x2 - p[6] * sign - r * spring) / p[0]
    f[2] = spring / p[1]
    slope = p[2] + 3.0 * p[3] * x1 * x1
    im, ia = 1.0 / p[0], 1.0 / p[1]
    for j in range(7):
        dr = r * s[1, j] - s[2, j]
        force = slope * s[0, j] + p[4] * dr
        ds[0, j] = dr
        ds[1, j] = (-p[5] * s[1, j] - r * force) * im
        ds[2, j] = force * ia
    ds[1, 0] -= f[1] * im
    ds[2, 1] -= f[2] * ia
    ds[1, 2] -= r * x1 * im
    ds[2, 2] += x1 * ia
    ds[1, 3] -= r * cube * im
    ds[2, 3] += cube * ia
    ds[1, 4] -= r * rate * im
    ds[2, 4] += rate * ia
    ds[1, 5] -= x2 * im
    ds[1, 6] -= sign * im


@numba.njit(error_model="numpy")
def sensitivities(p, u, r, h, out, jacobian):
    """Motor velocity and its derivatives (n, 7), one step per sample."""
    x = np.zeros(3)
    s = np.zeros((3, 7))
    f = np.zeros((4, 3))
    ds = np.zeros((4, 3, 7))
    y, t = np.zeros(3), np.zeros((3, 7))
    for k in range(u.size):
        out[k] = x[1]
        jacobian[k] = s[1]
        _variation(x[0], x[1], x[2], s, u[k], p, r, f[0], ds[0])
        for stage in range(1, 4):
            w = h if stage == 3 else 0.5 * h
            for i in range(3):
                y[i] = x[i] + w * f[stage - 1, i]
                for j in range(7):
                    t[i, j] = s[i, j] + w * ds[stage - 1, i, j]
            _variation(y[0], y[1], y[2], t, u[k], p, r, f[stage], ds[stage])
        for i in range(3):
            x[i] += h / 6.0 * (f[0, i] + 2.0 * (f[1, i] + f[2, i]) + f[3, i])
            for j in range(7):
                total = ds[0, i, j] + 2.0 * (ds[1, i, j] + ds[2, i, j]) + ds[3, i, j]
                s[i, j] += h / 6.0 * total


@dataclass(frozen=True)
class Record:
    """Torque and measured motor velocity."""

    torque: Array
    velocity: Array


def references(seed: int = 1) -> list[Array]:
    """Velocity references of section 9.4: a triangle, and twice a multisine on a square wave."""
    period = ex.triangle(5.0, SAMPLE_S, amplitude=40.0).period
    out = [np.concatenate([period, period[:2500]])]
    for number, (peak, height) in enumerate([(5.0, 8.0), (10.0, 12.0)]):
        tones = ex.multisine(5.0, SAMPLE_S, band_hz=(1.0, 40.0), seed=seed, run=number)
        # A hundred iterations of clipping give about the crest factor of 1.55 that was used.
        clipping = ex.Clipping(iterations=100)
        found = ex.optimize_crest_factor(tones, starts=1, clipping=clipping, refinement="none")
        wave = found.signal.period
        out.append(
            peak / np.abs(wave).max() * wave + ex.square(5.0, SAMPLE_S, amplitude=height).period
        )
    return out


def records(crumbs: int = CRUMBS, seed: int = 1) -> list[Record]:
    """The three records of the loop, the plant in ``crumbs`` steps per sample."""
    out = []
    for reference in references(seed):
        u, y = np.empty_like(reference), np.empty_like(reference)
        closed_loop(TRUTH, reference, RATIO, SAMPLE_S, KP, KI, crumbs, u, y)
        out.append(Record(u, y))
    return out


def fit(data: list[Record], start: Array, *, analytic: bool):
    """SciPy's trust region with scaled parameters and tight tolerances."""
    n = sum(r.torque.size for r in data)
    out, jacobian = np.empty(n), np.empty((n, 7))
    ends = np.cumsum([r.torque.size for r in data])
    measured = np.concatenate([r.velocity for r in data])

    def residual(p: Array) -> Array:
        for r, end in zip(data, ends, strict=True):
            simulate(p, r.torque, RATIO, SAMPLE_S, out[end - r.torque.size : end])
        return out - measured

    def derivative(p: Array) -> Array:
        for r, end in zip(data, ends, strict=True):
            part = slice(end - r.torque.size, end)
            sensitivities(p, r.torque, RATIO, SAMPLE_S, out[part], jacobian[part])
        return jacobian

    # The damping starts at zero, which is no scale.
    scale = np.where(start == 0, 1e-3 * start[2], start)
    lower = np.array([1e-6, 1e-6, 1e-6, -1.0, 0.0, 0.0, 0.0]) * scale
    lower[3] = -np.inf
    begin = np.maximum(start, lower + 1e-9 * scale)
    return least_squares(
        residual,
        begin,
        jac=derivative if analytic else "2-point",
        bounds=(lower, np.inf),
        method="trf",
        x_scale=scale,
        ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12,
        max_nfev=200,
    )
