"""What is wrong with records before an axis is fitted to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.graybox.axis_model import AxisData, AxisModel

Array = NDArray[np.float64]

# Samples after the first from which the speed at the start is found.
START_SAMPLES = 8
# Standard errors and share of the root mean square speed beyond which a start is doubted, and
# refused. White noise passes 5 standard errors in one record out of two million. Slow noise does
# not show in differences of samples: against it a start is refused only at a share that noise
# of a tenth of the motion reaches in three out of a thousand.
DOUBTED = (5.0, 0.01)
REFUSED = (8.0, 0.3)


def check_data(model: AxisModel, data_sets: Sequence[AxisData] | AxisData) -> tuple[AxisData, ...]:
    """Return the records, each with the output the model needs."""
    data = (data_sets,) if isinstance(data_sets, AxisData) else tuple(data_sets)
    if not data:
        raise InputError("data_sets: expected at least one AxisData, got none")
    for i, record in enumerate(data):
        if not isinstance(record, AxisData):
            raise InputError(f"data_sets[{i}]: expected AxisData, got {type(record).__name__}")
        record.measured(model)
        # A difference needs one sample more than the speed at the start is found from.
        least = max(4 * model.n_masses, START_SAMPLES + 1)
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


def check_start(
    model: AxisModel, data: Sequence[AxisData], values: Mapping[str, float]
) -> tuple[str, ...]:
    """Refuse records clearly in motion at their first sample that the model starts at rest.

    Returns words for those that may be, if their noise is not slow. ``values`` are all
    parameters, roughly right.
    """
    out = []
    for i, record in enumerate(data if model.initial == "rest" else ()):
        speed, error = initial_speed(model, record, values)
        size = float(np.sqrt(np.mean(motion(model, record) ** 2)))
        text = (
            f"{speed:.3g} rad/s at its first sample (standard error {error:.2g}, root mean "
            f"square of the record {size:.3g}). Use AxisModel(initial='free'), which estimates "
            "the state at the start, or begin the record where the axis stands"
        )
        if all(_beyond(speed, error, size, REFUSED)):
            raise InputError(
                f"{label(i, record)}: expected a start at rest, as initial='rest' says, got {text}"
            )
        if all(_beyond(speed, error, size, DOUBTED)):
            out.append(f"{label(i, record)} seems to start in motion: {text}")
    return tuple(out)


def _beyond(speed: float, error: float, size: float, limits: tuple[float, float]) -> list[bool]:
    return [abs(speed) > limits[0] * error, abs(speed) > limits[1] * size]


def initial_speed(
    model: AxisModel, record: AxisData, values: Mapping[str, float]
) -> tuple[float, float]:
    """Return the motor speed at the first sample beyond a start at rest, and its standard error.

    What the first samples have beyond a simulation from rest is a straight line in velocity (a
    parabola in position), whose value at the first sample is the speed; the simulation takes out
    jumps of the torque, the slope what its inertia misses. The noise is the larger of that
    about the line and that from third differences of the record.
    """
    n, step = START_SAMPLES, record.sample_time_s
    torque = np.asarray(record.torque_nm)[: n + 1]
    measured = record.measured(model)
    rest = [record.start_angle_rad(), *[0.0] * (2 * model.n_masses - 1)]
    short = (torque, np.zeros_like(torque), step, 1.0, 1)
    theta = [*model.vector(values), *rest]
    simulated = _core.axis_simulate(model.core(), short, theta, predicts=False)[0]
    at, degree, place = np.arange(n, dtype=np.float64), 1, 0
    deviation = measured[:n] - simulated[:n]
    if model.output == "velocity_difference":
        # The first difference is none: that of the second sample is the speed between both.
        at, deviation = at + 0.5, measured[1 : n + 1] - simulated[1 : n + 1]
    elif model.output == "position":
        degree, place = 2, 1
    columns = np.vander(at, degree + 1, increasing=True)
    inverse = np.linalg.inv(columns.T @ columns)
    line = inverse @ (columns.T @ deviation)
    about = np.linalg.norm(deviation - columns @ line) / np.sqrt(n - degree - 1)
    noise = max(float(about), noise_std(measured))
    unit = 1 / step if place else 1.0
    return float(line[place]) * unit, noise * float(np.sqrt(inverse[place, place])) * unit


def noise_std(measured: Array) -> float:
    """Return the standard deviation of white noise on a smooth signal, from third differences.

    A third difference of white noise has 1 + 9 + 9 + 1 times its variance; the mean size of a
    normal number is sqrt(2 / pi) standard deviations.
    """
    return float(np.mean(np.abs(np.diff(measured, 3))) * np.sqrt(np.pi / 2 / 20))


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
