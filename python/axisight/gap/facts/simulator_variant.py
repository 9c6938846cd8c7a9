"""Measured and simulated torque side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.logs import Log

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Variant:
    """A simulator: the robot's parameters, some replaced, and effects added to or replacing its own."""

    robot_values: Mapping[str, float]
    effects: tuple[Effect, ...] = ()


AS_GIVEN = Variant({})


def relative_squares(log: Log, error: Array) -> Array:
    """Return squared errors (n, n_axes) relative to the variance of the measured torque [1]."""
    variance = np.var(log.torque_nm, axis=0)
    return np.asarray(error**2 / np.maximum(variance, 1e-300))


def combine(per_log: Sequence[Array]) -> Array:
    """Return the gap per axis (n_axes,) from mean squares (n_axes,) of each log."""
    return np.asarray(np.sqrt(np.mean(per_log, axis=0)))
