"""Finds the axis whose speed the remainder of another axis follows, as where gears share friction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.settings import Settings
from axisight.gap.measure.where import ErrorLog
from axisight.gap.signals.lowpass_cutoff import direction, highest_cutoff_hz
from axisight.logs import differentiate

Array = NDArray[np.float64]


def axis_followed(logs: Sequence[ErrorLog], axis: int, settings: Settings) -> int | None:
    """Return the axis (from 0) whose speed or direction the error of ``axis`` (from 0) follows; None if it does none.

    What the axis' own speed, direction and acceleration explain is removed first. The other axis must explain at
    least ``smallest_score`` of the squared error above noise, by ``significance`` standard errors over blocks.
    """
    motions = [_motion(item) for item in logs]
    error = np.concatenate([item.error[:, axis] for item in logs])
    noise = np.concatenate([item.noise[:, axis] for item in logs])
    own = [np.stack([np.ones(len(v)), *_of(v, axis), a[:, axis]], axis=1) for v, a in motions]
    left = _without(np.concatenate(own), error)
    above = float(left @ left) - float(noise @ noise)
    best, found = settings.smallest_score, None
    for other in range(logs[0].error.shape[1]):
        if other == axis or above <= 0:
            continue
        more = [np.stack(_of(v, other), axis=1) for v, _ in motions]
        both = np.concatenate([np.hstack(x) for x in zip(own, more, strict=True)])
        fall = left**2 - _without(both, error) ** 2
        share = float(fall.sum()) / above
        if share > best and _is_sure(fall, logs, settings):
            best, found = share, other
    return found


def _motion(item: ErrorLog) -> tuple[Array, Array]:
    """Return speeds and accelerations of the motors (n, n_axes)."""
    step = item.log.sample_time_s
    return differentiate(item.log.position_rad, step, highest_cutoff_hz(step))


def _of(speed: Array, axis: int) -> tuple[Array, Array]:
    return speed[:, axis], direction(speed[:, axis])


def _without(columns: Array, error: Array) -> Array:
    """Return an error (n,) without what columns (n, k) explain; columns of an axis that stands count for nothing."""
    scale = np.sqrt(np.mean(columns**2, axis=0))
    columns = columns[:, scale > 0] / scale[scale > 0]
    return np.asarray(error - columns @ np.linalg.lstsq(columns, error, rcond=None)[0])


def _is_sure(fall: Array, logs: Sequence[ErrorLog], settings: Settings) -> bool:
    """Whether the mean fall of the squared error exceeds its standard error over blocks, clearly."""
    length = max(1, round(settings.block_s / logs[0].log.sample_time_s))
    blocks = np.array_split(fall, max(2, len(fall) // length))
    means = np.array([block.mean() for block in blocks])
    spread = float(means.std(ddof=1)) / np.sqrt(len(means))
    return bool(means.mean() > settings.significance * spread)
