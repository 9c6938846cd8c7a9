"""Checks whether a position follows its target to the end of a log: a motor that is off does not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_controller.follows_reference import ALIKE, UNLIKE
from axisight.gap.gate.by_controller.follows_target import LATE_S
from axisight.logs import Log

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def check_stopped_following(log: Log) -> list[Finding]:
    """Return a refusal for each axis that follows its target up to a time and not any more from then on.

    The target is that of the position, or the sum of the velocity reference. Both are compared within stretches of
    twice the longest delay. An axis counts as stopped in these conditions:

    - Most stretches with a moving target are followed before that time, and none is after it.
    - There are at least two of them after it, and the position moves less than the target there.
    - The position does not answer the target there either, with any gain and phase: a target that is faster than the
      loop is answered, if not followed.

    A target that rests tells nothing, and a position that comes late is compared with the target of that time before.
    """
    target = _target(log)
    if target is None or not np.isfinite(target).all():
        return []
    out = []
    for axis in range(log.n_axes):
        at = _stopped_at(log.position_rad[:, axis], target[:, axis], log.sample_time_s)
        if at is not None:
            message = (
                f"expected a position that follows its target, got one that stops doing so soon after {at:.3g} s, as "
                f"if the motor were off. Cut the log there (--to {at:.3g})"
            )
            field = f"position_{axis + 1}"
            out.append(Finding("stopped_following", "refuse", message, log.name, axis + 1, field))
    return out


def _target(log: Log) -> Array | None:
    """Return the targets of the positions (n, n_axes) [rad] up to a constant; None if there are none."""
    if log.position_ref_rad is not None:
        return log.position_ref_rad
    if log.velocity_ref_rad_s is None:
        return None
    return np.asarray(np.cumsum(log.velocity_ref_rad_s, axis=0) * log.sample_time_s)


def _stopped_at(position: Array, target: Array, step_s: float) -> float | None:
    """Return the time [s] up to which a position (n,) surely follows its target (n,); None if it follows to the end."""
    latest = min(round(LATE_S / step_s), len(position) // 2)
    # Steps of a twentieth of the longest delay miss little of a motion that is followed at all.
    apart = max(1, latest // 20)
    length = max(2, round(2 * LATE_S / step_s) // apart) * apart
    x, y = position[::apart], target[::apart]
    tried = range(latest // apart + 1)
    each = [_stretches(x[lag:], y[: len(y) - lag], length // apart) for lag in tried]
    # The delay of the loop is that with which most is followed.
    left, less, moving = max(each, key=lambda x: int(np.sum((x[0] < ALIKE) & x[2])))
    follows = np.flatnonzero(moving & (left < ALIKE))
    if not len(follows):
        return None
    last = int(follows[-1])
    before, after = moving.copy(), moving.copy()
    before[last + 1 :] = after[: last + 1] = False
    over = np.sum(after) >= 2 and bool(np.all((left[after] > UNLIKE) & less[after]))
    mostly = np.mean(left[before] < ALIKE) > 0.5
    if not (over and mostly) or np.median(_answered(position, target, length)[after]) > UNLIKE:
        return None
    # The last stretch that is followed may hold the time itself.
    return float(last * length * step_s)


def _answered(position: Array, target: Array, length: int) -> Array:
    """Return the share of a position's motion that a target and its rate explain, by stretch (n_stretches,).

    A constant and a drift of the position are no motion.
    """
    out = []
    line = np.column_stack([np.ones(length), np.linspace(-1.0, 1.0, length)])
    for first in range(0, len(target) // length * length, length):
        part = slice(first, first + length)
        x, y = (
            z[part] - line @ np.linalg.lstsq(line, z[part], rcond=None)[0]
            for z in (position, target)
        )
        told = np.column_stack([y, np.gradient(y)])
        left = x - told @ np.linalg.lstsq(told, x, rcond=None)[0]
        out.append(1.0 - float(left @ left) / max(float(x @ x), 1e-300))
    return np.array(out)


def _stretches(position: Array, target: Array, length: int) -> tuple[Array, Mask, Mask]:
    """Return three properties of each stretch of ``length`` samples, (n_stretches,) each.

    - The mean square of position minus target, relative to that of the target, both without their means.
    - Whether the position moves less than the target.
    - Whether the target moves as it does in the others.
    """
    count = len(position) // length
    x, y = (z[: count * length].reshape(count, length) for z in (position, target))
    x, y = x - x.mean(axis=1, keepdims=True), y - y.mean(axis=1, keepdims=True)
    size, power = (x**2).mean(axis=1), (y**2).mean(axis=1)
    moving = power > UNLIKE * np.median(power[power > 0]) if np.any(power > 0) else power > 0
    left = ((x - y) ** 2).mean(axis=1) / np.maximum(power, 1e-300)
    return left, size < power, moving
