"""The three steps of chapter 9 in one call.

Wernholt (2004), section 9.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.frf import etfe
from axisight.graybox.axis_model import AxisData, AxisModel
from axisight.graybox.axis_result import AxisFit
from axisight.graybox.axis_search import FitSettings
from axisight.graybox.chain_fit import fit_chain
from axisight.graybox.flexibilities import (
    CubicSpring,
    Flexibility,
    cubic_spring,
    initial_flexibility,
    simulate_deflection,
)
from axisight.graybox.prediction_error import NoiseKind, fit_axis
from axisight.graybox.procedure_report import report
from axisight.graybox.step_one import RigidBodyFriction, rigid_body_friction
from axisight.graybox.validation import ResidualTests, fit_percent, residual_tests
from axisight.logs import Log
from axisight.records import Experiment, prepare_records

Real = NDArray[np.float64]
Lines = Sequence[int] | NDArray[np.int64]

_LEAST_DAMPING = 0.01
"""Twice the damping ratio of a mass on its spring, at which a chain starts at least."""
_LAG_S = 0.005
"""Spacing of the lags of residual tests: a robot's motion has little beyond 100 Hz."""


@dataclass(frozen=True)
class InitialModel:
    """What steps 1 and 2 found.

    rigid
        Step 1.
    responses, flexibilities
        Frequency response (torque to motor acceleration) of each broadband record and what it
        gave.
    spring
        k1 and k3 by (9.14); None with one amplitude.
    start
        Start of step 3 by the names of the model.
    findings
        What to know.
    """

    rigid: RigidBodyFriction
    responses: tuple[xr.Dataset, ...]
    flexibilities: tuple[Flexibility, ...]
    spring: CubicSpring | None
    start: Mapping[str, float]
    findings: tuple[str, ...]


@dataclass(frozen=True)
class AxisIdentification:
    """Result of :func:`identify_axis`: the values of each step.

    model
        Structure.
    data_sets
        What was fitted: the low-frequency record, then the broadband ones.
    initial
        Steps 1 and 2.
    fit
        Step 3.
    initial_fit_percent
        Fit (3.54) of the initial model, one for each of ``data_sets``; those of step 3 are
        ``fit.fit_percent``.
    tests
        Residual tests of step 3, one for each of ``data_sets``.
    """

    model: AxisModel
    data_sets: tuple[AxisData, ...]
    initial: InitialModel
    fit: AxisFit
    initial_fit_percent: tuple[float, ...]
    tests: tuple[ResidualTests, ...]

    def report(self) -> str:
        """Return the values of each step, fits, tests and findings as text."""
        return report(self)


def axis_data(log: Log, axis: int = 1) -> AxisData:
    """Return one axis of a log as data for a fit.

    Torque, position and the backward difference of the position, zero at the first sample, as
    the velocity: models of it have ``output="velocity_difference"``. Raises InputError for an
    axis the log does not have.
    """
    if isinstance(axis, bool) or axis not in range(1, log.n_axes + 1):
        raise InputError(f"axis: expected 1 to {log.n_axes}, got {axis!r}")
    position = log.position_rad[:, axis - 1]
    velocity = np.diff(position, prepend=position[:1]) / log.sample_time_s
    torque = log.torque_nm[:, axis - 1]
    return AxisData(torque, velocity, position, sample_time_s=log.sample_time_s, name=log.name)


def initial_model(
    rigid: AxisData | Log,
    broadband: Sequence[AxisData | Log],
    *,
    gear_ratio: float,
    axis: int = 1,
    n_masses: int = 2,
    period_s: float | None = None,
    lines: Lines | None = None,
    drop_periods: int | None = None,
    cutoff_hz: float = 5.0,
    least_speed_rad_s: float = 0.0,
    notch_band_hz: tuple[float, float] | None = None,
    plateau_from_hz: float | None = None,
    spring_method: Literal["samples", "sets"] = "sets",
) -> InitialModel:
    """Return initial parameters by steps 1 and 2.

    Step 1 (:func:`rigid_body_friction`) from ``rigid``; step 2 (:func:`initial_flexibility`)
    from the response of each of ``broadband``, whose J_m are averaged; k1 and k3 from their
    stiffnesses (:func:`cubic_spring`). With more than two masses the chain comes from
    :func:`fit_chain` on the record of the smallest torque.

    Parameters
    ----------
    rigid : low-frequency motion in both directions, e.g. a triangle wave.
    broadband : periodic records, of different amplitudes for k3.
    gear_ratio : r, joint angle per motor angle.
    axis : of logs, from 1.
    n_masses : of the model.
    period_s, lines, drop_periods : of the broadband records; None: found from the reference of
        logs, else from the torque, see :func:`axisight.records.prepare_records`.
    cutoff_hz, least_speed_rad_s : of step 1.
    notch_band_hz, plateau_from_hz : of step 2.
    spring_method : of :func:`cubic_spring`; ``"samples"`` is (9.14) to the letter.

    Raises InputError as these functions do, and for records without position.

    """
    first = _as_data(rigid, axis, "rigid")
    records = [_as_data(b, axis, f"broadband {i}") for i, b in enumerate(broadband, 1)]
    if not records:
        raise InputError("broadband: expected at least one record, got none")
    found = rigid_body_friction(
        first.torque_nm,
        _position(first),
        first.sample_time_s,
        cutoff_hz=cutoff_hz,
        least_speed_rad_s=least_speed_rad_s,
    )
    responses = []
    findings = [*found.findings]
    for record, data in zip(broadband, records, strict=True):
        reference = _reference(record, axis)
        response, notes = _response(data, reference, period_s, lines, drop_periods)
        responses.append(response)
        findings += [f"{data.name}: {text}" for text in notes]
    flexibilities = tuple(
        initial_flexibility(
            response,
            rigid_inertia_kg_m2=found.inertia_kg_m2,
            rigid_standard_error=found.inertia_standard_error,
            gear_ratio=gear_ratio,
            notch_band_hz=notch_band_hz,
            plateau_from_hz=plateau_from_hz,
        )
        for response in responses
    )
    for data, one in zip(records, flexibilities, strict=True):
        findings += [f"{data.name}: {text}" for text in one.findings]
    motor = float(np.mean([f.motor_inertia_kg_m2 for f in flexibilities]))
    arm = (found.inertia_kg_m2 - motor) / gear_ratio**2
    stiffness = np.array([arm * f.notch.frequency_rad_s**2 for f in flexibilities])
    spring = None
    if len(records) > 1:
        spring = _spring(
            records, flexibilities, stiffness, motor, arm, found, gear_ratio, spring_method
        )
        findings += list(spring.findings)
    else:
        findings.append("one broadband record only: k3 starts at zero; measure a second amplitude")
    # A spring that softens with the cube of its deflection gives way beyond some torque.
    usable = spring is not None and spring.cubic_nm_rad3 >= 0 and spring.linear_nm_rad > 0
    if spring is not None and not usable:
        findings.append("step 3 starts with k3 = 0 and the mean stiffness")
    linear = spring.linear_nm_rad if spring and usable else stiffness.mean()
    parameters = {
        "J_m": motor,
        "J_a": arm,
        "k1": float(linear),
        "k3": spring.cubic_nm_rad3 if spring and usable else 0.0,
        "d": float(np.mean([f.damping_nm_s_rad for f in flexibilities])),
        "F_v": max(found.viscous_friction_nm_s_rad, 0.0),
        "F_c": max(found.coulomb_friction_nm, 0.0),
    }
    if n_masses > 2:
        quiet = min(
            range(len(records)), key=lambda i: float(np.std(np.asarray(records[i].torque_nm)))
        )
        parameters |= _chain(responses[quiet], n_masses, gear_ratio, findings)
    return InitialModel(
        found, tuple(responses), flexibilities, spring, parameters, tuple(dict.fromkeys(findings))
    )


def identify_axis(
    rigid: AxisData | Log,
    broadband: Sequence[AxisData | Log],
    *,
    gear_ratio: float,
    axis: int = 1,
    model: AxisModel | None = None,
    initial: InitialModel | None = None,
    fixed: Iterable[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    noise_model: NoiseKind = "output_error",
    settings: FitSettings | None = None,
    closed_loop: bool = True,
    period_s: float | None = None,
    lines: Lines | None = None,
    drop_periods: int | None = None,
    cutoff_hz: float = 5.0,
    notch_band_hz: tuple[float, float] | None = None,
    plateau_from_hz: float | None = None,
) -> AxisIdentification:
    """Identify one axis from motor-side records: rigid body, friction, flexibility.

    Wernholt (2004), section 9.3: step 1 and 2 give a start (:func:`initial_model`), step 3 fits
    all records at once by their prediction errors (:func:`fit_axis`), then the residuals are
    tested (:func:`residual_tests`), against the reference where logs have one, else the torque.

    Parameters
    ----------
    rigid : low-frequency motion in both directions, from rest.
    broadband : periodic records of several periods, from rest, of different amplitudes.
    gear_ratio : r, joint angle per motor angle.
    axis : of logs, from 1.
    model : structure of step 3; default two masses with a cubic gear spring, Coulomb friction
        and the backward difference of the position as output.
    initial : start here instead of from steps 1 and 2.
    fixed, bounds, noise_model, settings : of :func:`fit_axis`.
    closed_loop : whether a controller was at work, for the residual tests.
    period_s, lines, drop_periods, cutoff_hz, notch_band_hz, plateau_from_hz : of
        :func:`initial_model`.

    Raises InputError as the three steps do.

    """
    model = model or AxisModel(gear_ratio=gear_ratio, output="velocity_difference")
    if not np.isclose(model.gear_ratio, gear_ratio, rtol=1e-12):
        raise InputError(
            f"gear_ratio: expected that of the model, {model.gear_ratio}, got {gear_ratio}"
        )
    if initial is None:
        initial = initial_model(
            rigid,
            broadband,
            gear_ratio=gear_ratio,
            axis=axis,
            n_masses=model.n_masses,
            period_s=period_s,
            lines=lines,
            drop_periods=drop_periods,
            cutoff_hz=cutoff_hz,
            notch_band_hz=notch_band_hz,
            plateau_from_hz=plateau_from_hz,
        )
    data = tuple(
        _as_data(d, axis, name)
        for d, name in zip(
            [rigid, *broadband], ["rigid", *map("broadband {}".format, range(1, 99))], strict=False
        )
    )
    known = set(model.parameter_names)
    start = {name: value for name, value in initial.start.items() if name in known}
    fit = fit_axis(
        model, data, start, fixed=fixed, bounds=bounds, noise_model=noise_model, settings=settings
    )
    before = tuple(
        fit_percent(
            d.measured(model),
            model.simulate(start, d.torque_nm, d.sample_time_s)["output"].values,
        )
        for d in data
    )
    tests = tuple(
        _tests(residual, d, _reference(record, axis), closed_loop)
        for residual, d, record in zip(fit.residuals, data, [rigid, *broadband], strict=True)
    )
    return AxisIdentification(model, data, initial, fit, before, tests)


def _tests(
    residual: Real, data: AxisData, reference: Real | None, closed_loop: bool
) -> ResidualTests:
    """Test against the reference, which nothing feeds back into, or else the torque."""
    step = max(1, round(_LAG_S / data.sample_time_s))
    signal = np.asarray(data.torque_nm) if reference is None else reference
    return residual_tests(
        residual,
        signal[-len(residual) :],
        lag_step=step,
        closed_loop=closed_loop and reference is None,
    )


def _reference(record: AxisData | Log, axis: int) -> Real | None:
    if not isinstance(record, Log) or record.velocity_ref_rad_s is None:
        return None
    reference = record.velocity_ref_rad_s[:, axis - 1]
    return reference if np.isfinite(reference).all() and np.ptp(reference) > 0 else None


def _as_data(record: AxisData | Log, axis: int, name: str) -> AxisData:
    if isinstance(record, Log):
        return axis_data(record, axis)
    if not isinstance(record, AxisData):
        raise InputError(f"{name}: expected AxisData or a Log, got {type(record).__name__}")
    if record.velocity_rad_s is None:
        position = _position(record)
        velocity = np.diff(position, prepend=position[:1]) / record.sample_time_s
        record = replace(record, velocity_rad_s=velocity)
    return record if record.name else replace(record, name=name)


def _position(data: AxisData) -> Real:
    if data.position_rad is None:
        raise InputError(f"{data.name or 'record'}: expected position_rad, got none")
    return np.asarray(data.position_rad, dtype=np.float64)


def _response(
    data: AxisData,
    reference: Real | None,
    period_s: float | None,
    lines: Lines | None,
    drop_periods: int | None,
) -> tuple[xr.Dataset, list[str]]:
    """Return torque to motor acceleration, and what puts it in doubt."""
    run = Experiment(
        data.sample_time_s, np.asarray(data.torque_nm), _position(data), reference, data.name
    )
    prepared = prepare_records([run], period_s=period_s, lines=lines, drop_periods=drop_periods)
    notes = [finding.message for finding in prepared.serious]
    if lines is None and reference is None:
        notes.append(
            "excited lines were found from the torque, which friction distorts: give lines"
        )
    return etfe(prepared.records, quantity="acceleration"), notes


def _spring(
    records: Sequence[AxisData],
    flexibilities: Sequence[Flexibility],
    stiffness: Real,
    motor: float,
    arm: float,
    rigid: RigidBodyFriction,
    ratio: float,
    method: Literal["samples", "sets"],
) -> CubicSpring:
    """k1 and k3 from deflections simulated with the linear spring of each record."""
    deflections = [
        simulate_deflection(
            record.torque_nm,
            np.asarray(record.velocity_rad_s),
            record.sample_time_s,
            motor_inertia_kg_m2=motor,
            arm_inertia_kg_m2=arm,
            stiffness_nm_rad=float(k),
            damping_nm_s_rad=one.damping_nm_s_rad,
            viscous_friction_nm_s_rad=rigid.viscous_friction_nm_s_rad,
            coulomb_friction_nm=rigid.coulomb_friction_nm,
            gear_ratio=ratio,
        )
        for record, one, k in zip(records, flexibilities, stiffness, strict=True)
    ]
    errors = [
        2 * k * one.notch.frequency_standard_error_rad_s / one.notch.frequency_rad_s
        for one, k in zip(flexibilities, stiffness, strict=True)
    ]
    # What one line decides alone has no standard error.
    known = errors if np.isfinite(errors).all() else None
    return cubic_spring(stiffness.tolist(), deflections, standard_error_nm_rad=known, method=method)


def _chain(
    response: xr.Dataset, n_masses: int, ratio: float, findings: list[str]
) -> dict[str, float]:
    """Chain of the response in the names of the model."""
    found = fit_chain(response, n_masses, gear_ratio=ratio)
    findings += list(found.findings)
    chain = found.chain
    out = {"J_m": chain.motor_inertia_kg_m2}
    for i, inertia in enumerate(chain.inertia_kg_m2[1:], 1):
        out["J_a" if i == 1 else f"J_a{i}"] = float(inertia)
    # A cubic spring's notch can look undamped; the search starts off the bound.
    least = _LEAST_DAMPING * np.sqrt(chain.stiffness_nm_rad * chain.inertia_kg_m2[1:])
    dampers = np.maximum(chain.damping_nm_s_rad, least)
    for i, (k, d) in enumerate(zip(chain.stiffness_nm_rad, dampers, strict=True), 1):
        out["k1" if i == 1 else f"k1_{i}"] = float(k)
        out["d" if i == 1 else f"d_{i}"] = float(d)
    return out
