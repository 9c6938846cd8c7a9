"""Variables that a remainder may depend on, and the ways in which it acts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.remainder.records import Motion

Array = NDArray[np.float64]
Acts = Literal["torque", "direction", "way", "speed", "load"]

CORNER = 0.01
"""Speed where the smoothed direction turns, as a share of the largest speed."""


@dataclass(frozen=True)
class Variable:
    """A variable: how it is read from a motion (n,) for one axis (from 0), its unit, and its words.

    ``warp``: share of the largest value above which the scale is logarithmic; None for an even scale. ``others``:
    whether the variable of another axis may matter.
    """

    words: str
    unit: str
    read: Callable[[Motion, int], Array]
    warp: float | None = None
    others: bool = False


def _temperature(motion: Motion, axis: int) -> Array:
    if motion.temperature_c is None:
        return np.full(len(motion.time_s), np.nan)
    return motion.temperature_c[:, axis]


VARIABLES: Mapping[str, Variable] = {
    "constant": Variable("nothing else", "1", lambda m, _: np.zeros(len(m.time_s))),
    "speed": Variable("speed", "rad/s", lambda m, k: m.velocity_rad_s[:, k], 0.03, True),
    "angle": Variable("angle", "rad", lambda m, k: m.position_rad[:, k], None, True),
    "load": Variable("load", "Nm", lambda m, k: m.load_nm[:, k], None, True),
    "acceleration": Variable(
        "acceleration", "rad/s^2", lambda m, k: m.acceleration_rad_s2[:, k], None, True
    ),
    "travel": Variable(
        "travel since the last reversal", "rad", lambda m, k: m.travel_rad[:, k], 0.02
    ),
    "temperature": Variable("temperature", "degC", _temperature),
    "time": Variable("time", "s", lambda m, _: m.time_s),
}
"""Variables by name; `Term.variable` is one of these names."""


def direction(speed: Array, corner_rad_s: float) -> Array:
    """Return the sign of a speed (n,), smoothed below the corner [rad/s]."""
    return np.asarray(speed / np.sqrt(speed**2 + max(corner_rad_s, 1e-300) ** 2))


ACTS: Mapping[Acts, tuple[str, str]] = {
    "torque": ("a torque", "Nm"),
    "direction": ("a torque against the motion", "Nm"),
    "way": ("a torque against the last motion, also at standstill", "Nm"),
    "speed": ("a torque against the motion that grows with speed", "Nm s/rad"),
    "load": ("a torque that grows with the load", "1"),
}
"""How a term acts, in words, and the unit of its function."""


def factor(acts: Acts, motion: Motion, axis: int, corner_rad_s: float) -> Array:
    """Return what a term's function is multiplied by (n,)."""
    if acts == "torque":
        return np.ones(len(motion.time_s))
    if acts == "way":
        return motion.way[:, axis]
    if acts == "load":
        return motion.load_nm[:, axis]
    speed = motion.velocity_rad_s[:, axis]
    return speed if acts == "speed" else direction(speed, corner_rad_s)
