"""Checks whether positions follow their targets, in logs without torque."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_controller.follows_reference import ALIKE, FOLLOWS, SIZE, UNLIKE
from axisight.gap.signals.unit_scales import scale_name
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Largest delay of a position after its target [s]: loops may be soft.
LATE_S = 0.3


def check_follows_target(robot: Robot, log: Log) -> list[Finding]:
    """Return findings about positions that follow another axis' target, or their own by a wrong factor or sign."""
    if log.position_ref_rad is None or log.n_axes != robot.n_axes:
        return []
    position, target = log.position_rad, log.position_ref_rad
    lags = range(min(round(LATE_S / log.sample_time_s), log.n_samples // 2) + 1)
    left, ratio = zip(*(_followed(position, target, lag) for lag in lags), strict=True)
    least = np.min(left, axis=0)
    # Correlation of each position with its own target, at the lag where it is largest.
    own = np.array([np.diag(r) for r in ratio])
    best = np.abs(own).argmax(axis=0)
    out = []
    for i in range(log.n_axes):
        alike, other = own[best[i], i], int(np.argmin(least[i]))
        size = _size(position[:, i], target[:, i], lags[best[i]])
        if least[i, i] > UNLIKE and least[i, other] < ALIKE and least[other, i] < ALIKE:
            out.append(_other(log, i, other))
        elif alike <= -FOLLOWS and SIZE[0] < -size < SIZE[1]:
            out.append(_against(log, i))
        elif alike >= FOLLOWS and not SIZE[0] < size < SIZE[1]:
            out.append(_factor(robot, log, i, size))
    return out


def _followed(position: Array, target: Array, lag: int) -> tuple[Array, Array]:
    """Return the relative mean square of position i minus target j, ``lag`` samples earlier, and the correlations.

    Both (n_axes, n_axes).
    """
    x, y = position[lag:], target[: len(target) - lag]
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    power, given = (np.maximum((z**2).mean(axis=0), 1e-300) for z in (x, y))
    both = x.T @ y / len(x)
    left = (power[:, None] - 2 * both + given[None, :]) / power[:, None]
    return left, both / np.sqrt(np.outer(power, given))


def _size(position: Array, target: Array, lag: int) -> float:
    """Return the ratio of a position to its target (n,), by least squares."""
    x, y = position[lag:], target[: len(target) - lag]
    x, y = x - x.mean(), y - y.mean()
    return float(x @ y / max(float(y @ y), 1e-300))


def _other(log: Log, i: int, other: int) -> Finding:
    message = (
        f"expected a position that follows the target of axis {i + 1}, got one that follows that of axis "
        f"{other + 1}, and the other way round. Exchange the columns of positions or of targets"
    )
    return Finding("axes_swapped", "refuse", message, log.name, i + 1, f"position_{i + 1}")


def _against(log: Log, i: int) -> Finding:
    message = (
        "expected a position that follows its target, got one that moves against it. Change the sign of the "
        "position or of the target"
    )
    return Finding("sign_flipped", "refuse", message, log.name, i + 1, f"position_{i + 1}")


def _factor(robot: Robot, log: Log, i: int, ratio: float) -> Finding:
    name = scale_name("position", ratio, float(robot.gear_ratio[i]))
    message = (
        f"expected a position of the size of its target, got one {ratio:.4g} times as large. State units and gear "
        "of both in a column map"
    )
    return Finding(name, "refuse", message, log.name, i + 1, f"position_{i + 1}")
