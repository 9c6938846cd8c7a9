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
) -> list[int]:
    """Return the ``count`` strongest integer orders, strongest first.

    Greedy least squares of the residuals (one array per log) on the sine and
    cosine of ``n phi``, each order judged on the samples where it lies below
    ``bandwidth_hz``. ``speed_power`` 2 multiplies the regressors by the square
    of the speed: an angle error seen through an inertia.
    """
    left = [r - r.mean() for r in residuals]
    found: list[int] = []
    for _ in range(count):
        gains = [
            0.0
            if n in found
            else _gain(left, angles_rad, speeds_rad_s, n, bandwidth_hz, speed_power)
            for n in range(1, HIGHEST_ORDER + 1)
        ]
        if max(gains) <= 0:
            break
        best = int(np.argmax(gains)) + 1
        found.append(best)
        left = [
            _remove(r, a, v, best, bandwidth_hz, speed_power)
            for r, a, v in zip(left, angles_rad, speeds_rad_s, strict=True)
        ]
    return found


def _regressors(
    angle: Array, speed: Array, order: int, bandwidth_hz: float, power: int
) -> tuple[Array, NDArray[np.bool_]]:
    used = np.abs(speed) * order < 2 * np.pi * bandwidth_hz
    weight = np.abs(speed) ** power
    wave = np.stack([np.cos(order * angle), np.sin(order * angle)], axis=1)
    return wave * weight[:, None], used


def _gain(
    residuals: Sequence[Array],
    angles: Sequence[Array],
    speeds: Sequence[Array],
    order: int,
    bandwidth_hz: float,
    power: int,
) -> float:
    """Squared error one order removes, one amplitude and phase for all logs."""
    normal, projection = np.zeros((2, 2)), np.zeros(2)
    for r, a, v in zip(residuals, angles, speeds, strict=True):
        x, used = _regressors(a, v, order, bandwidth_hz, power)
        # The mean of a wave over too short a stretch would pass for an offset.
        x = x[used] - (x[used].mean(axis=0) if used.any() else 0.0)
        normal += x.T @ x
        projection += x.T @ r[used]
    if np.linalg.cond(normal) > 1e8:
        return 0.0
    return float(projection @ np.linalg.solve(normal, projection))


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
