"""Torques that change much within a step: taken at the speed with which the step ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from axisight.errors import ConvergenceError

Array = NDArray[np.float64]

_MOST_STEPS = 60
_TOLERANCE = 1e-9
# Newton's step and halves of it are looked at together.
_SHARES = 0.5 ** np.arange(12)[:, None]


def torque_at_end(
    torque: Callable[[Array], Array], free: Array, gain: Array, least: float = 0.0
) -> Array:
    """Return the torques x (n,) [Nm] with ``x = torque(free + gain x)``.

    ``torque`` gives those (m, n) of speeds (m, n) [rad/s], each of its own speed alone; ``free`` (n,) is the
    speed at the end of the step without them, and ``gain`` (n, n) [rad/s/Nm] what they add. Dry friction
    at the speed of its beginning would throw a light joint to and fro; at that of its end it stops it.
    ``least`` [Nm]: by how little ``torque`` may be off anyhow, by rounding.

    Newton's method, the best of a step and its halves. Raises ConvergenceError where it does not end.
    """
    x = torque(free[None])[0]
    for _ in range(_MOST_STEPS):
        speed = free + gain @ x
        nudge = 1e-6 * (np.abs(speed) + np.abs(free)) + 1e-12
        below, here, above = torque(np.stack([speed - nudge, speed, speed + nudge]))
        left = x - here
        size = np.abs(x).max() + np.abs(here).max()
        if np.abs(left).max() <= _TOLERANCE * size + least:
            return np.asarray(here)
        slope = (above - below) / (2 * nudge)
        step = np.linalg.solve(np.eye(len(x)) - slope[:, None] * gain, -left)
        tried = x + _SHARES * step
        off = np.abs(tried - torque(free + tried @ gain.T)).max(axis=1)
        x = tried[int(np.argmin(off))]
    raise ConvergenceError(
        f"effects: expected torques that a step of this length can hold, got {left.tolist()} Nm off after "
        f"{_MOST_STEPS} iterations: take a shorter timestep"
    )
