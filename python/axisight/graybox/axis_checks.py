"""Checks of records before the fit of an axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.graybox.axis_model import AxisData, AxisModel

Array = NDArray[np.float64]

# Samples after the first that give the speed at the start.
START_SAMPLES = 8
# Limits of the speed at the start, as standard errors and as a share of the rms speed: above DOUBTED
# a warning, above REFUSED an error. White noise exceeds 5 standard errors in one record out of two
# million. Slow noise does not show in differences of samples, so the share protects against it: noise
# of a tenth of the motion reaches the refused share in three records out of a thousand.
DOUBTED = (5.0, 0.01)
REFUSED = (8.0, 0.3)


def check_data(model: AxisModel, data_sets: Sequence[AxisData] | AxisData) -> tuple[AxisData, ...]:
    """Return the records; raises InputError unless each has the output and length that the model needs."""
    data = (data_sets,) if isinstance(data_sets, AxisData) else tuple(data_sets)
    if not data:
        raise InputError("data_sets: expected at least one AxisData, got none")
    for i, record in enumerate(data):
        if not isinstance(record, AxisData):
            raise InputError(f"data_sets[{i}]: expected AxisData, got {type(record).__name__}")
        record.measured(model)
        # A difference needs one sample more than START_SAMPLES.
        least = max(4 * model.n_masses, START_SAMPLES + 1)
        if len(record) < least:
            raise InputError(
                f"{label(i, record)}: expected at least {least} samples, got {len(record)}"
            )
    return data


def label(i: int, record: AxisData) -> str:
    """Return the name of a record."""
    return record.name or f"data set {i + 1}"


def check_energy(model: AxisModel, data: Sequence[AxisData]) -> None:
    """Raise InputError for records in which the motor takes more energy out of the axis than it put in.

    From rest, the work of the motor torque becomes kinetic energy, elastic energy and losses, so it is
    never negative. If it is, torque and motion have opposite signs. Noise fed back to the torque does
    some negative work, so a tenth of the total absolute work is allowed.
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
    """Return warnings for records that may be in motion at their first sample, if the model starts at rest.

    Raises InputError for records that clearly are. A warning assumes that the noise is not slow.
    ``values`` are all parameters, roughly right.
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
    """Return the motor speed at the first sample [rad/s], and its standard error.

    The first samples minus a simulation from rest follow a straight line in velocity (a parabola in
    position), whose value at the first sample is the speed. The simulation removes jumps of the
    torque, and the slope of the line absorbs errors of its inertia. The noise is the larger of the
    scatter about the line and the estimate from third differences of the record.
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
        # The first sample has no difference; that of the second is the speed between both.
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

    A third difference of white noise has 1 + 9 + 9 + 1 times the variance of the noise. The mean
    absolute value of a normal number is sqrt(2 / pi) standard deviations.
    """
    return float(np.mean(np.abs(np.diff(measured, 3))) * np.sqrt(np.pi / 2 / 20))


def motion(model: AxisModel, record: AxisData) -> Array:
    """Return the motor velocity of a record [rad/s]."""
    measured = record.measured(model)
    if model.output == "position":
        return np.gradient(measured, record.sample_time_s)
    return measured


def reversals(velocity: Array) -> int:
    """Return the number of changes of direction between speeds above a tenth of the rms."""
    size = float(np.sqrt(np.mean(velocity**2)))
    signs = np.sign(velocity[np.abs(velocity) > 0.1 * size])
    return int(np.count_nonzero(np.diff(signs)))


def data_warnings(
    model: AxisModel, data: Sequence[AxisData], free: Sequence[str]
) -> tuple[str, ...]:
    """Return warnings about free parameters that these records do not show."""
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
