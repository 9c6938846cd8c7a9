"""The low-passed motion of a log, from which inverse dynamics predicts a torque."""

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


# Ratio of the motion's own cutoff to that of the torques. The motion's low-pass takes 0.4 % at the torques'
# cutoff.
_ABOVE = 2.0
# Largest cutoff of a low-pass, as a share of the sample rate.
_BELOW_NYQUIST = 0.45
# Periods of the cutoff after which the low-pass's response is below 0.1 %.
_RINGS = 3.0
# Order of the low-pass's gain. It is twice the filter's order, since the filter runs forward and backward.
_ORDER = 2 * LOWPASS_ORDER
# Length of an end in motion that is left out, in periods of the cutoff: the torque beyond the end counts for 1
# % after it.
_FORGETS = 1.5
# Largest length of such an end, as a share of the log.
_AT_MOST = 0.2
# Length of the ramp after a left-out end, as a share of that end.
_FADES = 1 / 3
# Motion of an axis, as a share of its largest in a quarter of a period, below which the axis is at rest.
_RESTS = 0.02


@dataclass(frozen=True)
class Filtering:
    """How a motion is made of a log, and how torques are low-passed before they are compared.

    Predicted and measured torques pass the same low-pass of ``cutoff_hz``, so that a reversal of friction is
    smeared alike in both. The motion for the prediction passes a low-pass one octave higher. ``measured``
    (n_axes): whether the velocity and acceleration of an axis come from its measured velocity, not from its
    position.
    """

    cutoff_hz: float
    measured: tuple[bool, ...] = ()

    def __call__(self, log: Log) -> Motion:
        """Return the low-passed motion of a log with its torque as logged."""
        cutoff_hz = self.motion_cutoff_hz(log.sample_time_s)
        position, velocity, acceleration, _ = motion(log, cutoff_hz, self.measured)
        return position, velocity, acceleration, np.ascontiguousarray(log.torque_nm)

    def motion_cutoff_hz(self, sample_time_s: float) -> float:
        """Return the cutoff [Hz] of the low-pass for the motion."""
        highest = max(self.cutoff_hz, _BELOW_NYQUIST / sample_time_s)
        return min(_ABOVE * self.cutoff_hz, highest)

    def compared(self, torque_nm: Array, sample_time_s: float) -> Array:
        """Return a predicted or measured torque (n, n_axes), low-passed for the comparison."""
        return lowpass(torque_nm, sample_time_s, self.cutoff_hz)

    def counted(self, log: Log) -> Array:
        """Return the weight of each sample of a compared torque (n,), from 0 to 1.

        The low-pass needs torque before and after the log. If the log begins or ends at rest, that torque is
        constant. In motion it is unknown: such an end has weight 0, followed by a smooth ramp to 1.
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
        """Return the largest size (n, n_axes) after `compared` of a torque of this size and of unknown sign."""
        reach = round(_RINGS / (self.cutoff_hz * sample_time_s))
        impulse = np.zeros((4 * reach + 1, 1))
        impulse[2 * reach] = 1.0
        answer = np.abs(self.compared(impulse, sample_time_s)[reach : 3 * reach + 1, 0])
        return np.asarray(scipy.ndimage.convolve1d(size_nm, answer, axis=0, mode="nearest"))

    def gain(self, frequency_hz: Array) -> Array:
        """Return the gain of the low-pass of `compared` (n_freq,)."""
        return np.asarray(1 / (1 + (frequency_hz / self.cutoff_hz) ** _ORDER))


def _moves(log: Log, cutoff: float) -> tuple[bool, bool]:
    """Return whether a log begins and whether it ends in motion; ``cutoff``: in periods per sample."""
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

    - ``curved``: motion is extended beyond the ends of the log with its curvature. Torque never is: friction
      breaks it at reversals, and a curvature across a break has no meaning.
    - ``measured`` (n_axes): axes whose velocity is the measured one, low-passed, and whose acceleration is its
      derivative.

    Raises InputError if ``measured`` names an axis and the log has no velocity.
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
    """Return whether every log has a measured velocity of an axis (n_axes,)."""
    measured = [
        np.zeros(log.n_axes, bool)
        if log.velocity_rad_s is None
        else np.isfinite(log.velocity_rad_s).all(axis=0)
        for log in logs
    ]
    return np.asarray(np.all(measured, axis=0))
