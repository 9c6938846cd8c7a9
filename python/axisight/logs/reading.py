"""Read a log strictly: any fault raises LogError."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from axisight.errors import LogError
from axisight.logs.columns import UNKNOWN
from axisight.logs.findings import raise_errors
from axisight.logs.gather import Gathered, gather
from axisight.logs.grid import Grid, make_grid
from axisight.logs.log import DIRECTIONS, Floats, Log, not_logged
from axisight.logs.map_files import AnyMap
from axisight.logs.recorded import recorded_rows
from axisight.logs.sources import log_name
from axisight.logs.validate import check_axes, check_finite, check_lengths

if TYPE_CHECKING:
    from axisight.robot import Robot


def read_log(
    path: Path | str,
    columns: AnyMap | Path | str | None = None,
    *,
    n_axes: int | None = None,
    robot: Robot | None = None,
    max_bytes: int | None = None,
    currents: bool = False,
) -> Log:
    """Return a log in SI units on a uniform time grid that starts at 0.

    The suffix of `path` chooses the format: .parquet, .csv, .tsv (both also with .gz), .json, .jsonl, .ndjson,
    .mat (v5, v7.3), .h5, .hdf5, .npy, .npz, .mcap, .bag or .db3. A rosbag2 or LeRobot log is a folder;
    `folder#3` is episode 3 of a LeRobot folder.

    `columns` is a column map, the path of one, or the name of a shipped one (`ur-rtde`, `franka`, ...).
    None is for files with the native column names of `axisight.case/1`, for ROS recordings and for LeRobot
    folders. `robot` is the robot that was logged. Its joint names give the order of the axes in recordings,
    its gear ratios convert joint-side signals to the motor side, and its torque constants (Nm/A) convert
    currents without a scale.
    `n_axes` is the expected number of driven axes, by default that of the robot.
    `max_bytes` limits the bytes of the mapped columns, counted as read and again as signals; the default is
    64 MiB plus sixteen times the size of the files. Columns that are not mapped are not read.
    `currents` accepts currents with an unknown torque constant (scale "unknown"), which a diagnosis finds.

    Raises LogError, naming file, column, what was expected and what came, for:

    - a file that is missing, truncated or corrupt, or declares more than `max_bytes`;
    - a missing column or axis, or another number of axes than `n_axes`;
    - NaN or inf, and signals of unequal lengths;
    - time that does not increase, gaps, and jitter beyond 1 % of a sample;
    - a declared rate that the stamps contradict, and logs shorter than 1 s;
    - joint-side signals or currents without the robot that they need.

    Raises MissingExtraError if a library for the format is not installed, and InputError for a `max_bytes`
    that is not a whole number from 1.
    """
    return log_of(
        gather(path, columns, robot, max_bytes), n_axes=n_axes, robot=robot, currents=currents
    )


def log_of(
    found: Gathered,
    *,
    n_axes: int | None = None,
    robot: Robot | None = None,
    currents: bool = False,
) -> Log:
    """Return the log of gathered signals; options and errors are those of `read_log`."""
    if found.columns.side == "joint" and robot is None:
        raise LogError(
            f"{found.path}: side: expected a robot, whose gear ratios turn signals of joints into those of "
            f"motors, got none"
        )
    _check_currents(found, robot, taken=currents)
    if n_axes is None and robot is not None:
        n_axes = robot.n_axes
    problems = [*found.findings, *check_axes(found, n_axes), *check_lengths(found)]
    raise_errors(found.path, problems)
    grid = grid_of(found)
    raise_errors(found.path, [*check_finite(found), *grid.findings])
    return _assemble(found, grid)


def _check_currents(found: Gathered, robot: Robot | None, *, taken: bool) -> None:
    """Raise LogError for currents that nothing converts to torques; ``taken`` allows unknown constants."""
    stated = found.currents - found.unknown.keys()
    if stated and robot is None:
        raise LogError(
            f"{found.path}: axis {min(stated) + 1}: torque: expected scale (Nm or N per A) with unit 'A', or a "
            f"robot that states its torque constants (of a model file, in its drive data), got neither"
        )
    if found.unknown and not taken:
        raise LogError(
            f"{found.path}: axis {min(found.unknown) + 1}: torque: expected scale (Nm or N per A), got "
            f'"{UNKNOWN}", with which only a diagnosis can do, and `read_log` for one with currents=True'
        )


def grid_of(found: Gathered) -> Grid:
    """Return the time grid of gathered signals, with its findings."""
    time = found.columns.time
    resample = time.resample_hz if time is not None else None
    assert resample != "mean"  # `gather` has replaced it by the rate
    n_samples = max((values.size for values in found.all_signals.values()), default=0)
    return make_grid(
        found.time_s,
        found.rate_hz,
        n_samples,
        label=time.label if time is not None else "sample_rate_hz",
        unmapped=None if found.mapped else str(found.path),
        resample_hz=resample,
        most_samples=found.most_samples,
    )


def _assemble(found: Gathered, grid: Grid) -> Log:
    assert grid.sample_time_s is not None  # make_grid sets it unless it reports an error
    time_s: Floats = grid.sample_time_s * np.arange(grid.n_samples, dtype=np.float64)

    def matrix(field: str) -> Floats | None:
        columns = [found.signals.get((field, axis)) for axis in range(len(found.columns.axis))]
        if all(column is None for column in columns):
            return None
        missing = np.full(grid.n_samples, np.nan)
        return np.column_stack(
            [missing if column is None else _on_grid(column, grid, time_s) for column in columns]
        )

    position, torque = matrix("position"), matrix("torque")
    assert position is not None
    return Log(
        name=log_name(found.path),
        sample_time_s=grid.sample_time_s,
        time_s=time_s,
        torque_nm=not_logged(position.shape) if torque is None else torque,
        position_rad=position,
        source=found.path,
        position_ref_rad=matrix("position_ref"),
        velocity_ref_rad_s=matrix("velocity_ref"),
        velocity_rad_s=matrix("velocity"),
        joint_position_rad=matrix("joint_position"),
        temperature_c=matrix("temperature"),
        acceleration_m_s2=_accelerations(found, grid, time_s),
        axis_kinds=tuple(
            "prismatic" if axis.prismatic else "revolute" for axis in found.columns.axis
        ),
        notes=(*grid.notes, *found.notes, *found.doubts),
        nominal_nm_a=_nominal(found),
        recorded=None
        if grid.stamps_s is None
        else recorded_rows(grid.stamps_s, found.signals, found.labels),
    )


def _accelerations(found: Gathered, grid: Grid, time_s: Floats) -> dict[str, Floats]:
    """Return the value of `Log.acceleration_m_s2`."""
    out: dict[str, Floats] = {}
    for (sensor, direction), values in found.accelerations.items():
        readings = out.setdefault(sensor, np.full((grid.n_samples, len(DIRECTIONS)), np.nan))
        readings[:, DIRECTIONS.index(direction)] = _on_grid(values, grid, time_s)
    return out


def _nominal(found: Gathered) -> tuple[float | None, ...]:
    """Return the value of `Log.nominal_nm_a`."""
    axes = range(len(found.columns.axis))
    return tuple(map(found.unknown.get, axes)) if found.unknown else ()


def _on_grid(values: Floats, grid: Grid, time_s: Floats) -> Floats:
    if grid.stamps_s is None:
        return values
    return np.asarray(np.interp(time_s, grid.stamps_s, values), dtype=np.float64)
