"""What a remainder is fitted to: motions with their torque error, and what must not change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError

Array = NDArray[np.float64]

# Smallest way back that counts as a reversal, as a share of the travel of the axis.
_REVERSES = 3e-4


@summarized
@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """A motion with what a torque may depend on; all arrays (n, n_axes), motor side.

    ``time_s`` (n,) [s], ``position_rad`` [rad], ``velocity_rad_s`` [rad/s], ``acceleration_rad_s2`` [rad/s^2],
    ``load_nm``: torque through the gear without rotor and friction [Nm], ``temperature_c`` [degC]; None if it was
    not logged. ``followed``: travel and direction as in `travel_rad` and `way`, of a motion that was followed from an
    earlier moment; by default they are followed from the first sample. On an axis that slides, rad reads m and Nm
    reads N. Raises InputError when shapes disagree.
    """

    name: str
    time_s: Array
    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    load_nm: Array
    temperature_c: Array | None = None
    followed: tuple[Array, Array] | None = None

    def __post_init__(self) -> None:
        """Check the shapes."""
        if self.position_rad.ndim != 2:
            raise InputError(
                f"position_rad: expected shape (n, axes), got {self.position_rad.shape}"
            )
        shape = self.position_rad.shape
        if self.time_s.shape != shape[:1]:
            raise InputError(f"time_s: expected shape ({shape[0]},), got {self.time_s.shape}")
        for field in ("velocity_rad_s", "acceleration_rad_s2", "load_nm", "temperature_c"):
            values = getattr(self, field)
            if values is not None and values.shape != shape:
                raise InputError(f"{field}: expected shape {shape}, got {values.shape}")

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return int(self.position_rad.shape[1])

    @cached_property
    def _followed(self) -> tuple[Array, Array]:
        if self.followed is not None:
            return self.followed
        least = _REVERSES * np.ptp(self.position_rad, axis=0)
        tracker = Travel(least)
        travel = np.empty(self.position_rad.shape)
        way = np.empty(self.position_rad.shape)
        for i, row in enumerate(self.position_rad):
            travel[i], way[i] = tracker(row)
        # A standstill before the first motion holds what the way there will need.
        for axis in range(self.n_axes):
            moved = np.flatnonzero(way[:, axis])
            if moved.size:
                way[: moved[0], axis] = way[moved[0], axis]
        return travel, way

    @property
    def travel_rad(self) -> Array:
        """Travel since the last reversal of each axis (n, n_axes) [rad]; since the start before the first one."""
        return self._followed[0]

    @property
    def way(self) -> Array:
        """Direction of the last motion of each axis (n, n_axes): 1 or -1, also while it stands.

        Before the first motion it is the direction of that motion; 0 on an axis that never moves.
        """
        return self._followed[1]


class Travel:
    """Follows the last direction and the travel since the last reversal, sample by sample.

    ``least_rad`` (n_axes,): the smallest way back that counts as a reversal [rad], so that noise is none.
    """

    def __init__(self, least_rad: Array) -> None:
        self._least = least_rad
        self.restart()

    def restart(self) -> None:
        """Forget the motion so far."""
        self._way = np.zeros(len(self._least))
        self._turned = np.zeros(0)
        self._farthest = np.zeros(0)

    def __call__(self, position_rad: Array) -> tuple[Array, Array]:
        """Return the travel [rad] and the direction (1, -1, or 0 before the first motion) of the next sample."""
        if not self._turned.size:
            self._turned, self._farthest = position_rad.copy(), position_rad.copy()
        away = position_rad - self._turned
        begins = (self._way == 0) & (np.abs(away) > self._least)
        self._way[begins] = np.sign(away[begins])
        ahead = self._way * (position_rad - self._farthest)
        turns = ahead < -self._least
        self._turned[turns] = self._farthest[turns]
        self._way[turns] *= -1
        moved = begins | turns | (ahead > 0)
        self._farthest[moved] = position_rad[moved]
        return np.abs(position_rad - self._turned), self._way.copy()


@dataclass(frozen=True, eq=False, kw_only=True)
class Record:
    """A motion with the torque that a simulator lacks along it.

    ``residual_nm`` (n, n_axes): measured minus simulated torque [Nm]. ``weight`` (n, n_axes): weight of each error,
    1 by default. ``protected`` (n, n_axes, p): torques by unit of each parameter of the causes, from which the
    remainder must take nothing: it is orthogonal to them, with the weights ``certainty`` (n, n_axes) of the fit that
    found the causes (by default ``weight``). ``lowpass``: the low-pass that ``residual_nm`` has passed, for arrays
    (n, m). Raises InputError when shapes disagree.
    """

    motion: Motion
    residual_nm: Array
    weight: Array | None = None
    protected: Array | None = None
    certainty: Array | None = None
    lowpass: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        """Check the shapes."""
        shape = self.motion.position_rad.shape
        for field in ("residual_nm", "weight", "certainty"):
            values = getattr(self, field)
            if values is not None and values.shape != shape:
                raise InputError(f"{field}: expected shape {shape}, got {values.shape}")
        if self.protected is not None and self.protected.shape[:2] != shape:
            got = self.protected.shape
            raise InputError(f"protected: expected shape ({shape[0]}, {shape[1]}, p), got {got}")

    def filtered(self, torque_nm: Array) -> Array:
        """Return torques (n, m) as the residual has them: behind the low-pass, if there is one."""
        return torque_nm if self.lowpass is None else self.lowpass(torque_nm)
