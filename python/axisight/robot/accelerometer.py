"""Accelerometers on the links of a robot."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import tomlkit
from numpy.typing import NDArray

from axisight.arguments import instance, reals, words
from axisight.display.summary import summarized
from axisight.errors import InputError

DIRECTIONS = ("x", "y", "z")
"""Names of the directions that an accelerometer measures, in their order."""
Vector = tuple[float, float, float]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_LINK_AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_UNIT_TOLERANCE = 1e-6


@summarized
@dataclass(frozen=True)
class Accelerometer:
    """An accelerometer that is fixed to the link of a joint.

    It measures the specific force: the acceleration of its place minus gravity. ``position_m`` (3,) [m] is its
    place in the frame of the link that moves with ``joint``. ``directions`` are one to three unit vectors in
    that frame, for the readings x, y and z; by default the axes of the frame. ``name`` consists of letters,
    digits and underscores, and is part of the log columns ``acceleration_<name>_x``.

    Raises InputError for another name, another shape, and vectors that are not of unit length.
    """

    name: str
    joint: str
    position_m: Vector
    directions: tuple[Vector, ...] = _LINK_AXES

    def __post_init__(self) -> None:
        """Check name and vectors, and make tuples of them."""
        if not _NAME.fullmatch(words("name", self.name)):
            raise InputError(
                "name: expected letters, digits and underscores that begin with a letter, got "
                f"{self.name!r}"
            )
        place = reals("position_m", self.position_m, "three numbers", 1)
        if place.shape != (3,):
            raise InputError(f"position_m: expected three numbers, got {place.size}")
        along = reals("directions", self.directions, "one to three unit vectors", 2)
        lengths = np.linalg.norm(along, axis=1)
        if (
            along.shape not in {(n, 3) for n in (1, 2, 3)}
            or np.abs(lengths - 1).max() > _UNIT_TOLERANCE
        ):
            raise InputError(
                f"directions: expected one to three unit vectors, got {along.tolist()}"
            )
        object.__setattr__(self, "position_m", tuple(place.tolist()))
        object.__setattr__(self, "directions", tuple(map(tuple, along.tolist())))

    @property
    def readings(self) -> tuple[str, ...]:
        """Names of its readings, such as ``elbow_x``."""
        return tuple(f"{self.name}_{d}" for d in DIRECTIONS[: len(self.directions)])


def accelerometer_of(
    entry: tuple[str, str, Sequence[float], Sequence[Sequence[float]]],
) -> Accelerometer:
    """Return the accelerometer of an entry from the compiled core."""
    name, joint, (x, y, z), directions = entry
    return Accelerometer(name, joint, (x, y, z), tuple((u, v, w) for u, v, w in directions))


def described_with(text: str, accelerometers: Sequence[Accelerometer]) -> str:
    """Return the text of a robot file with these accelerometers in place of its own.

    A file with accelerometers is of version 2. Comments and all other text stay.
    """
    document = tomlkit.parse(text)
    document.pop("accelerometer", None)
    if accelerometers:
        document["schema"] = "axisight.robot/2"
        tables = tomlkit.aot()
        for one in accelerometers:
            table = tomlkit.table()
            instance("accelerometers", one, Accelerometer)
            table.update(
                {
                    "name": one.name,
                    "joint": one.joint,
                    "position": list(one.position_m),
                    "directions": [list(d) for d in one.directions],
                }
            )
            tables.append(table)
        document["accelerometer"] = tables
    return tomlkit.dumps(document)


def by_direction(
    readings: NDArray[np.float64], accelerometers: Sequence[Accelerometer]
) -> NDArray[np.float64]:
    """Return readings (..., n_readings) as (..., n_accelerometers, 3), NaN where none is measured."""
    out = np.full((*readings.shape[:-1], len(accelerometers), len(DIRECTIONS)), np.nan)
    first = 0
    for place, one in enumerate(accelerometers):
        count = len(one.directions)
        out[..., place, :count] = readings[..., first : first + count]
        first += count
    return out
