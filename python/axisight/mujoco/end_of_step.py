"""Torques that change much within a step, solved for the speed at its end."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from axisight.errors import ConvergenceError

Array = NDArray[np.float64]

_MOST_STEPS = 60
_TOLERANCE = 1e-9
# Newton's step and its halves are evaluated in one call.
_SHARES = 0.5 ** np.arange(12)[:, None]


def torque_at_end(
    torque: Callable[[Array], Array], free: Array, gain: Array, least: float = 0.0
) -> Array:
    """Return the torques x (n,) [Nm] with ``x = torque(free + gain x)``.

    ``torque`` maps speeds (m, n) [rad/s] to torques (m, n); each torque depends on its own speed only.
    ``free`` (n,) is the speed at the end of the step without these torques, ``gain`` (n, n) [rad/s/Nm] what
    they add. Dry friction at the initial speed would throw a light joint to and fro; at the final speed it
    stops the joint. ``least`` [Nm] is the rounding error of ``torque``.

    Newton's method with the best of a step and its halves. Raises ConvergenceError if it does not converge.
    """
    tried = np.zeros((1, len(free)))
    for _ in range(_MOST_STEPS):
        # Values and slopes in one call, because the number of calls decides the time.
        speed = free + tried @ gain.T
        nudge = 1e-6 * (np.abs(speed) + np.abs(free)) + 1e-12
        below, here, above = np.split(torque(np.vstack([speed - nudge, speed, speed + nudge])), 3)
        off = np.abs(tried - here).max(axis=1)
        best = int(np.argmin(off))
        x, found = tried[best], here[best]
        if off[best] <= _TOLERANCE * (np.abs(x).max() + np.abs(found).max()) + least:
            return np.asarray(found)
        slope = (above[best] - below[best]) / (2 * nudge[best])
        step = np.linalg.solve(np.eye(len(x)) - slope[:, None] * gain, found - x)
        tried = x + _SHARES * step
    raise ConvergenceError(
        f"effects: expected torques that a step of this length can hold, got {off.min():.3g} Nm off after "
        f"{_MOST_STEPS} iterations: take a shorter timestep"
    )
