"""A remainder inside a simulation, moment by moment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError
from axisight.remainder.model import Remainder
from axisight.remainder.records import Motion, Travel

Array = NDArray[np.float64]

# Smallest way back that counts as a reversal, by default [rad], motor side.
_REVERSES_RAD = 0.02


class RunningRemainder:
    """The torque of a remainder at successive moments of a simulation; it remembers the last reversals.

    Parameters
    ----------
    remainder : from `fit_remainder` or `load_remainder`.
    start_way : direction in which each axis moved last before the start (n_axes,): 1, -1, or 0 if unknown.
    reverses_rad : smallest way back of a motor that counts as a reversal [rad].

    Raises InputError if ``start_way`` has another shape.

    """

    def __init__(
        self,
        remainder: Remainder,
        *,
        start_way: ArrayLike | None = None,
        reverses_rad: float = _REVERSES_RAD,
    ) -> None:
        n = remainder.n_axes
        self.remainder = remainder
        way = np.zeros(n) if start_way is None else np.asarray(start_way, dtype=np.float64)
        if way.shape != (n,):
            raise InputError(f"start_way: expected shape ({n},), got {way.shape}")
        self._start_way = way
        self._tracker = Travel(np.full(n, reverses_rad))
        self._time_s = -np.inf

    def __call__(
        self,
        time_s: float,
        position_rad: Array,
        velocity_rad_s: Array,
        acceleration_rad_s2: Array,
        load_nm: Array,
        temperature_c: Array | None = None,
    ) -> Array:
        """Return the torque (n_axes,) [Nm], motor side, at one moment; arguments (n_axes,) as those of `Motion`.

        A time before that of the last call begins a new run.
        """
        now = self.at(
            time_s, position_rad, velocity_rad_s, acceleration_rad_s2, load_nm, temperature_c
        )
        return np.asarray(self.remainder.torque(now)[0])

    def at(
        self,
        time_s: float,
        position_rad: Array,
        velocity_rad_s: Array,
        acceleration_rad_s2: Array,
        load_nm: Array,
        temperature_c: Array | None = None,
    ) -> Motion:
        """Return one moment as a motion of one sample; arguments as those of a call.

        A time before that of the last call begins a new run.
        """
        if time_s < self._time_s:
            self._tracker.restart()
        self._time_s = time_s
        travel, way = self._tracker(np.asarray(position_rad, dtype=np.float64))
        way = np.where(way == 0, self._start_way, way)
        rows = [position_rad, velocity_rad_s, acceleration_rad_s2, load_nm, travel, way]
        position, velocity, acceleration, load, travelled, ways = (
            np.asarray(x, dtype=np.float64)[None] for x in rows
        )
        return Motion(
            name="simulation",
            time_s=np.array([time_s]),
            position_rad=position,
            velocity_rad_s=velocity,
            acceleration_rad_s2=acceleration,
            load_nm=load,
            temperature_c=None if temperature_c is None else np.asarray(temperature_c)[None],
            followed=(travelled, ways),
        )

    def with_own_speeds(self, now: Motion, velocity_rad_s: Array) -> Array:
        """Return torques (m, n_axes) [Nm] at other speeds (m, n_axes) [rad/s] of their own axis.

        All else is as in ``now`` (from `at`), also the speeds of other axes.
        """
        m, n = velocity_rad_s.shape
        rows = replace(
            now,
            time_s=np.full(m, now.time_s[0]),
            position_rad=np.tile(now.position_rad, (m, 1)),
            velocity_rad_s=np.tile(now.velocity_rad_s, (m, 1)),
            acceleration_rad_s2=np.tile(now.acceleration_rad_s2, (m, 1)),
            load_nm=np.tile(now.load_nm, (m, 1)),
            temperature_c=None if now.temperature_c is None else np.tile(now.temperature_c, (m, 1)),
            followed=(np.tile(now.travel_rad, (m, 1)), np.tile(now.way, (m, 1))),
        )
        out = np.empty((m, n))
        for axis in range(n):
            speeds = rows.velocity_rad_s.copy()
            speeds[:, axis] = velocity_rad_s[:, axis]
            moved = replace(rows, velocity_rad_s=speeds)
            out[:, axis] = self.remainder.torque(moved)[:, axis]
        return out
