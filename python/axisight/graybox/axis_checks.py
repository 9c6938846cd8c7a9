"""What is wrong with records before an axis is fitted to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.graybox.axis_model import AxisData, AxisModel

Array = NDArray[np.float64]


def check_data(model: AxisModel, data_sets: Sequence[AxisData] | AxisData) -> tuple[AxisData, ...]:
    """Return the records, each with the output the model needs."""
    data = (data_sets,) if isinstance(data_sets, AxisData) else tuple(data_sets)
    if not data:
        raise InputError("data_sets: expected at least one AxisData, got none")
    for i, record in enumerate(data):
        if not isinstance(record, AxisData):
            raise InputError(f"data_sets[{i}]: expected AxisData, got {type(record).__name__}")
        record.measured(model)
        least = 4 * model.n_masses
        if len(record) < least:
            raise InputError(
                f"{label(i, record)}: expected at least {least} samples, got {len(record)}"
            )
    return data


def label(i: int, record: AxisData) -> str:
    """Name of a record."""
    return record.name or f"data set {i + 1}"


def check_energy(model: AxisModel, data: Sequence[AxisData]) -> None:
    """Refuse records in which the motor takes out more energy than the axis can have had.

    From rest, the work of the motor torque is kinetic and elastic energy and losses, never
    negative. Where it is, torque and motion have opposite signs. Noise that is fed back to the
    torque makes some negative work, so a tenth of the work turned over is let pass.
    """
    for i, record in enumerate(data):
        velocity = motion(model, record)
        power = np.asarray(record.torque_nm) * velocity
        turnover = np.abs(power).sum()
        if model.initial == "rest" and power.sum() < -0.1 * turnover:
            raise InputError(
                f"{label(i, record)}: expected torque that does work on the axis, got "
                f"{power.sum() * record.sample_time_s:.3g} J taken out of it: torque_nm and the "
                "measured motion have opposite signs. Turn one of them"
            )


def motion(model: AxisModel, record: AxisData) -> Array:
    """Motor velocity of a record [rad/s]."""
    measured = record.measured(model)
    if model.output == "position":
        return np.gradient(measured, record.sample_time_s)
    return measured


def reversals(velocity: Array) -> int:
    """Count changes of direction between speeds above a tenth of the root mean square."""
    size = float(np.sqrt(np.mean(velocity**2)))
    signs = np.sign(velocity[np.abs(velocity) > 0.1 * size])
    return int(np.count_nonzero(np.diff(signs)))


def data_warnings(
    model: AxisModel, data: Sequence[AxisData], free: Sequence[str]
) -> tuple[str, ...]:
    """Return in words what these records cannot tell about the free parameters."""
    out = []
    turns = sum(reversals(motion(model, d)) for d in data)
    dry = [name for name in ("F_c", "u_0", "F_s") if name in free]
    if turns == 0 and dry:
        out.append(
            f"the velocity never changes its sign: {', '.join(dry)} cannot be told from a "
            "constant torque. Add a record with reversals, such as a triangle in velocity"
        )
    if model.gear_ratio > 1:
        out.append(
            f"gear_ratio {model.gear_ratio:g} is above 1: it is joint angle per motor angle, "
            "1/224 for a gear of 224:1"
        )
    return tuple(out)
