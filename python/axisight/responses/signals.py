"""Motor torque, motor position and reference of the chosen axes of a log."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from axisight.arguments import Real, several, whole
from axisight.errors import InputError
from axisight.logs import Log
from axisight.records import Experiment


def chosen_axes(logs: Sequence[Log], axes: Sequence[int] | None) -> tuple[int, ...]:
    """Return the axes (from 1) to estimate: those given, or all that move in any log.

    Raises InputError for an axis that the logs do not have, for logs of different numbers of axes, and if no
    axis moves.
    """
    n = logs[0].n_axes
    for log in logs[1:]:
        if log.n_axes != n:
            raise InputError(
                f"logs: expected {n} axes as in {logs[0].name}, got {log.n_axes} in {log.name}"
            )
    if axes is not None:
        given = tuple(whole("axes", axis) for axis in several("axes", axes))
        for axis in given:
            if axis > n:
                raise InputError(f"axes: expected numbers from 1 to {n}, got {axis}")
        if len(set(given)) < len(given) or not given:
            raise InputError(f"axes: expected each axis once, got {list(given)}")
        return given
    moving = np.any([np.ptp(log.position_rad, axis=0) > 0 for log in logs], axis=0)
    if not moving.any():
        raise InputError("position: expected an axis that moves, got none in any log")
    return tuple(int(i) + 1 for i in np.flatnonzero(moving))


def experiment_of_axes(log: Log, axes: Sequence[int]) -> Experiment:
    """Return torque, motor position and reference of the ``axes`` (from 1) of a log.

    The reference is the velocity reference, or else the difference quotient of the position targets. It is
    None if the log has neither on every axis. Raises InputError for an axis without torque.
    """
    at = [axis - 1 for axis in axes]
    torque = log.torque_nm[:, at]
    for axis, column in zip(axes, torque.T, strict=True):
        if not np.isfinite(column).all():
            raise InputError(
                f"{log.name}: torque of axis {axis}: expected numbers, got none; log it, or leave the axis "
                "out by axes"
            )
    return Experiment(
        log.sample_time_s, torque, log.position_rad[:, at], _reference(log, at), name=log.name
    )


def _reference(log: Log, at: Sequence[int]) -> Real | None:
    speed = log.velocity_ref_rad_s
    if speed is not None and np.isfinite(speed[:, at]).all():
        return speed[:, at]
    target = log.position_ref_rad
    if target is None or not np.isfinite(target[:, at]).all():
        return None
    # Targets drift and fall with frequency, which would hide lines; their rate does neither.
    return np.diff(target[:, at], axis=0, prepend=target[:1, at]) / log.sample_time_s


def units(logs: Sequence[Log], axes: Sequence[int]) -> tuple[str, str]:
    """Return the units of input and output over the axes; raise InputError if axes mix Nm and A."""
    found = {
        (_input_unit(log, axis - 1), _output_unit(log, axis - 1)) for log in logs for axis in axes
    }
    inputs = sorted({unit for unit, _ in found})
    outputs = sorted({unit for _, unit in found})
    if "A" in inputs and len(inputs) > 1:
        raise InputError(
            "torque: expected one unit on all axes, got A (currents of unknown torque constant) and "
            f"{inputs[-1]}; state the constants in the column map"
        )
    # Revolute and prismatic axes together: the attribute `quantity` says what the output is.
    return " or ".join(inputs), " or ".join(outputs)


def _input_unit(log: Log, at: int) -> str:
    nominal = log.nominal_nm_a[at] if log.nominal_nm_a else None
    if nominal is not None and math.isnan(nominal):
        return "A"
    return "Nm" if log.axis_kinds[at] == "revolute" else "N"


def _output_unit(log: Log, at: int) -> str:
    return "rad" if log.axis_kinds[at] == "revolute" else "m"
