"""The motion of a log, low-passed: what inverse dynamics predicts a torque from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.logs import Log, differentiate, lowpass

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array, Array]
"""Position, velocity, acceleration and torque, each (n, n_axes), motor side."""


@dataclass(frozen=True)
class Filtering:
    """How a motion is made of a log.

    ``cutoff_hz`` of the low-pass, the same on all signals; ``measured`` (n_axes): whether velocity
    and acceleration of an axis come from its measured velocity instead of its position; ``curved``:
    whether motion goes on beyond the ends as curved as it is there.
    """

    cutoff_hz: float
    measured: tuple[bool, ...] = ()
    curved: bool = True

    def __call__(self, log: Log) -> Motion:
        """Return the motion of a log."""
        return motion(log, self.cutoff_hz, self.measured, curved=self.curved)


def motion(
    log: Log, cutoff_hz: float, measured: Sequence[bool] = (), *, curved: bool = True
) -> Motion:
    """Return position, velocity, acceleration and torque (n, n_axes), low-passed alike.

    ``curved``: beyond the ends of a log motion goes on as curved as it is. Torque does not:
    friction breaks it, and a curvature across a break is none.
    ``measured``: the axes whose velocity is the measured one, low-passed, and whose acceleration
    is its derivative. Raises InputError where the log has none.
    """
    velocity, acceleration = differentiate(
        log.position_rad, log.sample_time_s, cutoff_hz, curved=curved
    )
    axes = np.flatnonzero(measured)
    if axes.size:
        if log.velocity_rad_s is None:
            raise InputError(f"{log.name}: expected a measured velocity, got none")
        speed = lowpass(log.velocity_rad_s[:, axes], log.sample_time_s, cutoff_hz, curved=curved)
        velocity[:, axes] = speed
        acceleration[:, axes] = np.gradient(speed, log.sample_time_s, axis=0, edge_order=2)
    smooth = lowpass(log.position_rad, log.sample_time_s, cutoff_hz, curved=curved)
    torque = lowpass(log.torque_nm, log.sample_time_s, cutoff_hz)
    out = tuple(np.ascontiguousarray(x) for x in (smooth, velocity, acceleration, torque))
    return out[0], out[1], out[2], out[3]


def has_velocity(logs: Sequence[Log]) -> NDArray[np.bool_]:
    """Return the axes (n_axes,) whose velocity every log has measured."""
    measured = [
        np.zeros(log.n_axes, bool)
        if log.velocity_rad_s is None
        else np.isfinite(log.velocity_rad_s).all(axis=0)
        for log in logs
    ]
    return np.asarray(np.all(measured, axis=0))
