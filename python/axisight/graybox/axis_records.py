"""Conversion of logs and records of one axis to data for the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.graybox.axis_model import AxisData
from axisight.logs import Log
from axisight.robot.axis_names import axis_number

Real = NDArray[np.float64]


def axis_data(log: Log, axis: int = 1) -> AxisData:
    """Return one axis of a log as data for a fit.

    It has torque, position, and as velocity the backward difference of the position, zero at the
    first sample. Fit it with models of ``output="velocity_difference"``. ``axis`` counts from 1.
    Raises InputError for an axis that the log does not have.
    """
    axis = axis_number(axis, log.n_axes)
    position = log.position_rad[:, axis - 1]
    velocity = np.diff(position, prepend=position[:1]) / log.sample_time_s
    torque = log.torque_nm[:, axis - 1]
    return AxisData(torque, velocity, position, sample_time_s=log.sample_time_s, name=log.name)


def reference_of(record: AxisData | Log, axis: int) -> Real | None:
    """Return the velocity reference of a log (n,) [rad/s], None without one or if it is constant."""
    if not isinstance(record, Log) or record.velocity_ref_rad_s is None:
        return None
    reference = record.velocity_ref_rad_s[:, axis - 1]
    return reference if np.isfinite(reference).all() and np.ptp(reference) > 0 else None


def as_data(record: AxisData | Log, axis: int, name: str) -> AxisData:
    """Return a record, or one axis of a log, with velocity and name; raises InputError for other types."""
    if isinstance(record, Log):
        return axis_data(record, axis)
    if not isinstance(record, AxisData):
        raise InputError(f"{name}: expected AxisData or a Log, got {type(record).__name__}")
    if record.velocity_rad_s is None:
        position = position_of(record)
        velocity = np.diff(position, prepend=position[:1]) / record.sample_time_s
        record = replace(record, velocity_rad_s=velocity)
    return record if record.name else replace(record, name=name)


def position_of(data: AxisData) -> Real:
    """Return the position (n,) [rad]; raises InputError for a record without."""
    if data.position_rad is None:
        raise InputError(f"{data.name or 'record'}: expected position_rad, got none")
    return np.asarray(data.position_rad, dtype=np.float64)
