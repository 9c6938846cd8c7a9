"""Which orders of the motor angle stand out in a residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HIGHEST_ORDER = 80


def strongest_orders(
    residuals: Sequence[Array],
    angles_rad: Sequence[Array],
    speeds_rad_s: Sequence[Array],
    *,
    count: int,
    bandwidth_hz: float,
    speed_power: int = 0,
    least_turns: float = 0.0,
) -> list[int]:
    """Return the ``count`` strongest integer orders, strongest first.

    Greedy least squares of the residuals (one array per log) on the sine and
    cosine of ``n phi``, each order judged on the samples where it lies below
    ``bandwidth_hz``. ``speed_power`` 2 multiplies the regressors by the square
    of the speed: an angle error seen through an inertia. Orders that come round less often than
    ``least_turns`` over the travel are left out.
    """
    left = [r - r.mean() for r in residuals]
    waves = [
        _waves(a, v, bandwidth_hz, speed_power)
        for a, v in zip(angles_rad, speeds_rad_s, strict=True)
    ]
    normal = np.sum([np.einsum("aon,bon->oab", w, w) for w in waves], axis=0)
    usable = np.linalg.cond(normal) < 1e8
    travel = max(float(np.ptp(a)) for a in angles_rad)
    usable &= np.arange(1, HIGHEST_ORDER + 1) * travel >= 2 * np.pi * least_turns
    inverse = np.linalg.inv(np.where(usable[:, None, None], normal, np.eye(2)))
    found: list[int] = []
    for _ in range(count):
        along = np.sum([w @ r for w, r in zip(waves, left, strict=True)], axis=0)
        gains = np.where(usable, np.einsum("ao,oab,bo->o", along, inverse, along), 0.0)
        gains[[n - 1 for n in found]] = 0.0
        if gains.max() <= 0:
            break
        best = int(np.argmax(gains)) + 1
        found.append(best)
        left = [
            _remove(r, a, v, best, bandwidth_hz, speed_power)
            for r, a, v in zip(left, angles_rad, speeds_rad_s, strict=True)
        ]
    return found


def _waves(angle: Array, speed: Array, bandwidth_hz: float, power: int) -> Array:
    """Return cosine and sine of every order (2, orders, n), zero where it is out of reach."""
    order = np.arange(1, HIGHEST_ORDER + 1)[:, None]
    used = np.abs(speed) * order < 2 * np.pi * bandwidth_hz
    turning = np.cumprod(np.broadcast_to(np.exp(1j * angle), used.shape), axis=0)
    waves = np.stack([turning.real, turning.imag]) * np.abs(speed) ** power
    # The mean of a wave over too short a stretch would pass for an offset.
    mean = np.sum(waves * used, axis=-1, keepdims=True) / np.maximum(used.sum(-1), 1)[:, None]
    return np.asarray((waves - mean) * used)


def _regressors(
    angle: Array, speed: Array, order: int, bandwidth_hz: float, power: int
) -> tuple[Array, NDArray[np.bool_]]:
    used = np.abs(speed) * order < 2 * np.pi * bandwidth_hz
    wave = np.stack([np.cos(order * angle), np.sin(order * angle)], axis=1)
    return wave * (np.abs(speed) ** power)[:, None], used


def _remove(
    residual: Array, angle: Array, speed: Array, order: int, bandwidth_hz: float, power: int
) -> Array:
    x, used = _regressors(angle, speed, order, bandwidth_hz, power)
    if used.sum() < 4:
        return residual
    solution = np.linalg.lstsq(x[used], residual[used], rcond=None)[0]
    out = residual.copy()
    out[used] -= x[used] @ solution
    return out
