"""A remainder inside a simulation, moment by moment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import instance, positive
from axisight.errors import InputError
from axisight.remainder.model import Remainder
from axisight.remainder.records import Motion, Travel

Array = NDArray[np.float64]

# Smallest way back that counts as a reversal, by default [rad], motor side.
_REVERSES_RAD = 0.02


def last_way(position_rad: ArrayLike, *, reverses_rad: float = _REVERSES_RAD) -> Array:
    """Return the direction of the last motion of each axis (n_axes,): 1, -1, or 0 if it did not move.

    ``position_rad``: motor angles (n, n_axes) [rad] up to the moment in question, such as the end of a log.
    ``reverses_rad``: smallest way back of a motor that counts as a reversal [rad]. Raises InputError for another
    shape, and for numbers that are not finite.
    """
    angles = np.asarray(position_rad, dtype=np.float64)
    if angles.ndim != 2 or not angles.size or not np.isfinite(angles).all():
        raise InputError(f"position_rad: expected finite angles (n, axes), got {angles.shape}")
    tracker = Travel(np.full(angles.shape[1], positive("reverses_rad", reverses_rad)))
    way = np.zeros(angles.shape[1])
    for row in angles:
        _, way = tracker(row)
    return way


class RunningRemainder:
    """The torque of a remainder at successive moments of a simulation; it remembers the last reversals.

    Parameters
    ----------
    remainder : from `fit_remainder` or `load_remainder`.
    start_way : direction in which each axis moved last before the start (n_axes,): 1, -1, or 0 if unknown;
        `last_way` reads it from a log. By default that of the speed at the start, so 0 at rest: a term that acts
        against the last motion then waits for the first one.
    reverses_rad : smallest way back of a motor that counts as a reversal [rad].
    temperature_c : temperatures of the axes (n_axes,) [degC] for calls that give none.

    Raises InputError for other shapes, a direction that is none, a way back that is not positive, and a temperature
    that is not finite or that a term needs and nobody gives.

    """

    def __init__(
        self,
        remainder: Remainder,
        *,
        start_way: ArrayLike | None = None,
        reverses_rad: float = _REVERSES_RAD,
        temperature_c: ArrayLike | None = None,
    ) -> None:
        instance("remainder", remainder, Remainder)
        n = remainder.n_axes
        self.remainder = remainder
        self._given_way = None if start_way is None else _directions(start_way, n)
        self._start_way = np.zeros(n)
        # Below the corner of its terms an axis counts as standing.
        self._slow_rad_s = np.zeros(n)
        for term in remainder.terms:
            slow = self._slow_rad_s[term.axis - 1]
            self._slow_rad_s[term.axis - 1] = max(slow, term.corner_rad_s)
        self._temperature_c = None if temperature_c is None else _temperatures(temperature_c, n)
        self._tracker = Travel(np.full(n, positive("reverses_rad", reverses_rad)))
        self._time_s = np.inf

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

    def restart(self, start_way: Array) -> None:
        """Begin a new run; ``start_way`` (n_axes,) holds unless the constructor was given one."""
        self._tracker.restart()
        self._start_way = start_way if self._given_way is None else self._given_way
        self._time_s = -np.inf

    @property
    def lacks_temperature(self) -> bool:
        """Whether a term depends on temperatures and none were given for all calls."""
        needed = any(term.variable == "temperature" for term in self.remainder.terms)
        return needed and self._temperature_c is None

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
        if self._time_s > time_s:
            speed = np.asarray(velocity_rad_s, dtype=np.float64)
            self.restart(np.where(np.abs(speed) > self._slow_rad_s, np.sign(speed), 0.0))
        self._time_s = time_s
        if temperature_c is None:
            temperature_c = self._temperature_c
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


def _directions(start_way: ArrayLike, n_axes: int) -> Array:
    way = np.asarray(start_way, dtype=np.float64)
    if way.shape != (n_axes,):
        raise InputError(f"start_way: expected shape ({n_axes},), got {way.shape}")
    if not np.isin(way, (-1.0, 0.0, 1.0)).all():
        raise InputError(
            f"start_way: expected 1, -1 or 0 (unknown) for each axis, got {way.tolist()}"
        )
    return way


def _temperatures(temperature_c: ArrayLike, n_axes: int) -> Array:
    given = np.asarray(temperature_c, dtype=np.float64)
    if given.shape != (n_axes,) or not np.isfinite(given).all():
        raise InputError(f"temperature_c: expected {n_axes} finite numbers, got {given.tolist()}")
    return given
