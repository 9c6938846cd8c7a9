"""Find the shipped map that fits the names and numbers of a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from axisight.errors import InputError, LogError
from axisight.logs.columns import ColumnMap
from axisight.logs.guessing.evidence import LARGEST_JOINT_RAD, increases, time_units
from axisight.logs.log import Floats
from axisight.logs.map_files import load_column_map
from axisight.logs.maps import MAPS
from axisight.logs.patterns import ColumnPattern
from axisight.logs.sources import Arrays
from axisight.logs.unit_guess import velocity_ratio
from axisight.logs.units import si_factor
from axisight.robot import Robot

_ALIKE = 0.9


@dataclass(frozen=True)
class Fit:
    """A shipped map that fits a file with ``in_file`` axes.

    ``axes`` is the number of axes to take if the file has more than the robot, else None.
    """

    name: str
    in_file: int
    axes: int | None = None


def named_map(arrays: Arrays, robot: Robot | None, path: Path) -> tuple[Fit | None, list[str]]:
    """Return the shipped map that fits, or None and the reasons against maps whose names match.

    A map fits if the file has its time and the position and torque of every axis, and if the numbers agree
    with its units. If the file has more axes than the robot, the map takes the first ones.
    """
    against = []
    for name in MAPS:
        pattern = load_column_map(name)
        assert isinstance(pattern, ColumnPattern)
        try:
            columns = pattern.for_file(arrays, robot, path)
        except LogError:
            continue
        if not _all_there(columns, arrays, "position"):
            continue
        if not _all_there(columns, arrays, "torque"):
            looked_for = pattern.looked_for("torque", robot)
            against.append(f"the names are those of {name}, but no column is called {looked_for}")
            continue
        wrong = _contradiction(columns, arrays)
        in_file = len(columns.axis)
        if robot is not None and in_file < robot.n_axes:
            wrong = f"{in_file} axes, where the robot has {robot.n_axes}"
        if wrong is None:
            more = robot is not None and in_file > robot.n_axes
            return Fit(name, in_file, robot.n_axes if more and robot is not None else None), []
        against.append(f"the names are those of {name}, but {wrong}")
    return None, against


def _all_there(columns: ColumnMap, arrays: Arrays, field: str) -> bool:
    """Whether a file has the time of a map and this field as numbers for every axis."""
    if columns.time is None or columns.time.name not in arrays:
        return False
    wanted = [getattr(axis, field) for axis in columns.axis]
    return all(
        signal is not None and arrays.get(signal.name, np.zeros(0)).dtype.kind in "iuf"
        for signal in wanted
    )


def _contradiction(columns: ColumnMap, arrays: Arrays) -> str | None:
    """Return how the numbers contradict the units of a map; None if they do not."""
    time = columns.time
    assert time is not None
    stamps = np.asarray(arrays[time.name], dtype=np.float64)
    if not increases(stamps):
        return f"{time.name} does not increase with every sample"
    if time.unit not in time_units(stamps):
        return f"steps of {float(np.median(np.diff(stamps))):.4g} in {time.name} are no {time.unit}"
    sample_time_s = float(np.median(np.diff(stamps))) * si_factor(time.unit)
    for axis in columns.axis:
        position = _si(arrays, axis.position)
        if not axis.prismatic and np.abs(position[np.isfinite(position)]).max() > LARGEST_JOINT_RAD:
            return f"{axis.position.name} in {axis.position.unit} goes beyond what a joint can"
        if axis.velocity is None or axis.velocity.name not in arrays:
            continue
        velocity = _si(arrays, axis.velocity)
        if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
            continue
        try:
            ratio, alike = velocity_ratio(position, velocity, sample_time_s)
        except InputError:  # too short to tell
            continue
        if abs(alike) > _ALIKE and abs(ratio - 1.0) > 0.2:
            return (
                f"{axis.velocity.name} is {ratio:.4g} times the derivative of {axis.position.name}"
            )
    return None


def _si(arrays: Arrays, signal: Any) -> Floats:
    return np.asarray(arrays[signal.name], dtype=np.float64) * si_factor(signal.unit)
