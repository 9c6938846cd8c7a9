"""The motion of a log, low-passed: what inverse dynamics predicts a torque from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.logs import Log, differentiate, lowpass
from axisight.logs.filters import LOWPASS_ORDER

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array, Array]
"""Position, velocity, acceleration and torque, each (n, n_axes), motor side."""


# The motion's own low-pass lies this far above the cutoff: it takes 0.4 % of the motion there.
_ABOVE = 2.0
# Of the rate of a log, up to which a low-pass is one.
_BELOW_NYQUIST = 0.45
# Periods of the cutoff after which its low-pass has forgotten all but a thousandth.
_RINGS = 3.0
# Of the gain of the low-pass, which runs forward and backward.
_ORDER = 2 * LOWPASS_ORDER
# Of a log that begins or ends in motion, periods of the cutoff until what was before or after it is forgotten
# to a hundredth, and the largest share of the log at either end.
_FORGETS = 1.5
_AT_MOST = 0.2
# Of that, over which what is next to it counts in part.
_FADES = 1 / 3
# A log is at rest at an end where no axis moves by this share of the most that it does in a quarter of a period.
_RESTS = 0.02


@dataclass(frozen=True)
class Filtering:
    """How a motion is made of a log, and torques compared.

    Torques predicted and measured pass the same low-pass of ``cutoff_hz``: what friction makes of a
    reversal is smeared on both sides alike. The motion that a torque is predicted from passes one an
    octave above. ``measured`` (n_axes): whether velocity and acceleration of an axis come from its
    measured velocity instead of its position.
    """

    cutoff_hz: float
    measured: tuple[bool, ...] = ()

    def __call__(self, log: Log) -> Motion:
        """Return the motion of a log, and its torque as it is."""
        cutoff_hz = self.motion_cutoff_hz(log.sample_time_s)
        position, velocity, acceleration, _ = motion(log, cutoff_hz, self.measured)
        return position, velocity, acceleration, np.ascontiguousarray(log.torque_nm)

    def motion_cutoff_hz(self, sample_time_s: float) -> float:
        """Return the cutoff of the low-pass that the motion itself passes."""
        highest = max(self.cutoff_hz, _BELOW_NYQUIST / sample_time_s)
        return min(_ABOVE * self.cutoff_hz, highest)

    def compared(self, torque_nm: Array, sample_time_s: float) -> Array:
        """Return a torque (n, n_axes), predicted or measured, as it is compared."""
        return lowpass(torque_nm, sample_time_s, self.cutoff_hz)

    def counted(self, log: Log) -> Array:
        """Return what every sample of a compared torque counts for (n,), from 0 to 1.

        A low-pass needs the torque before and after a log. At rest it goes on as it is; in motion nobody
        knows it, and what the ends are padded with is no torque of a machine: such ends count for nothing,
        and what is next to them for a part.
        """
        n, cutoff = log.n_samples, self.cutoff_hz * log.sample_time_s
        away = min(round(_FORGETS / cutoff), int(_AT_MOST * n))
        beyond = (np.arange(n) / max(1, away) - 1.0) / _FADES
        ramp = np.sin(0.5 * np.pi * np.clip(beyond, 0.0, 1.0)) ** 2
        out = np.ones(n)
        for end, moves in zip(
            (slice(None), slice(None, None, -1)), _moves(log, cutoff), strict=True
        ):
            if moves:
                out[end] *= ramp
        return out

    def spread(self, size_nm: Array, sample_time_s: float) -> Array:
        """Return how large (n, n_axes) `compared` leaves a torque of that size and unknown sign at most."""
        reach = round(_RINGS / (self.cutoff_hz * sample_time_s))
        impulse = np.zeros((4 * reach + 1, 1))
        impulse[2 * reach] = 1.0
        answer = np.abs(self.compared(impulse, sample_time_s)[reach : 3 * reach + 1, 0])
        return np.asarray(scipy.ndimage.convolve1d(size_nm, answer, axis=0, mode="nearest"))

    def gain(self, frequency_hz: Array) -> Array:
        """Return the gain of `compared` (n_freq,)."""
        return np.asarray(1 / (1 + (frequency_hz / self.cutoff_hz) ** _ORDER))


def _moves(log: Log, cutoff: float) -> tuple[bool, bool]:
    """Return whether a log begins and whether it ends in motion; ``cutoff``: periods in a sample."""
    length = max(2, min(round(0.25 / cutoff), log.n_samples // 2))
    parts = [
        np.ptp(log.position_rad[i : i + length], axis=0)
        for i in (*range(0, log.n_samples - length, length), log.n_samples - length)
    ]
    least = _RESTS * np.max(parts, axis=0)
    return bool(np.any(parts[0] > least)), bool(np.any(parts[-1] > least))


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
