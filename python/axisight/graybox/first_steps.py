"""Steps 1 and 2 of chapter 9: the start of the fit of one axis.

Wernholt (2004), sections 9.3.1 and 9.3.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.etfe import etfe
from axisight.graybox.axis_model import AxisData
from axisight.graybox.axis_records import as_data, position_of, reference_of
from axisight.graybox.chain_fit import fit_chain
from axisight.graybox.flexibilities import (
    CubicSpring,
    Flexibility,
    cubic_spring,
    initial_flexibility,
    simulate_deflection,
)
from axisight.graybox.step_one import RigidBodyFriction, rigid_body_friction
from axisight.logs import Log
from axisight.records import Experiment, prepare_records

Real = NDArray[np.float64]
Lines = Sequence[int] | NDArray[np.int64]

_LEAST_DAMPING = 0.01
"""Least damping at the start of a chain: twice the damping ratio of a mass on its spring."""


@summarized
@dataclass(frozen=True)
class InitialModel:
    """Result of steps 1 and 2.

    rigid
        Result of step 1.
    responses, flexibilities
        Frequency response (torque to motor acceleration) of each broadband record, and its two-mass
        parameters.
    spring
        k1 and k3 by (9.14); None with one amplitude.
    start
        Start of step 3, by parameter names of the model.
    findings
        Warnings to read before using the values.
    """

    rigid: RigidBodyFriction
    responses: tuple[xr.Dataset, ...]
    flexibilities: tuple[Flexibility, ...]
    spring: CubicSpring | None
    start: Mapping[str, float]
    findings: tuple[str, ...]


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

    Step 1 (:func:`rigid_body_friction`) uses ``rigid``. Step 2 (:func:`initial_flexibility`) uses the
    response of each of ``broadband`` and averages their J_m. Their stiffnesses give k1 and k3
    (:func:`cubic_spring`). With more than two masses, :func:`fit_chain` on the record of the smallest
    torque gives the chain.

    Parameters
    ----------
    rigid : low-frequency motion in both directions, e.g. a triangle wave.
    broadband : periodic records, of different amplitudes for k3.
    gear_ratio : r, joint angle per motor angle.
    axis : axis of the logs, from 1.
    n_masses : number of masses of the model.
    period_s, lines, drop_periods : period [s], lines and dropped periods of the broadband records.
        None: detected from the reference of logs, or else from the torque, see
        :func:`axisight.records.prepare_records`.
    cutoff_hz, least_speed_rad_s : arguments of step 1.
    notch_band_hz, plateau_from_hz : arguments of step 2.
    spring_method : method of :func:`cubic_spring`; ``"samples"`` is (9.14) itself.

    Raises InputError as these functions do, and for records without position.

    """
    first = as_data(rigid, axis, "rigid")
    records = [as_data(b, axis, f"broadband {i}") for i, b in enumerate(broadband, 1)]
    if not records:
        raise InputError("broadband: expected at least one record, got none")
    found = rigid_body_friction(
        first.torque_nm,
        position_of(first),
        first.sample_time_s,
        cutoff_hz=cutoff_hz,
        least_speed_rad_s=least_speed_rad_s,
    )
    responses = []
    findings = [*found.findings]
    for record, data in zip(broadband, records, strict=True):
        reference = reference_of(record, axis)
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
    # A softening cubic spring cannot hold torques above some limit.
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


def _response(
    data: AxisData,
    reference: Real | None,
    period_s: float | None,
    lines: Lines | None,
    drop_periods: int | None,
) -> tuple[xr.Dataset, list[str]]:
    """Return the response from torque to motor acceleration, and warnings about it."""
    run = Experiment(
        data.sample_time_s, np.asarray(data.torque_nm), position_of(data), reference, data.name
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
    """Return k1 and k3 from deflections simulated with the linear spring of each record."""
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
    # A value that one line decides alone has no standard error.
    known = errors if np.isfinite(errors).all() else None
    return cubic_spring(stiffness.tolist(), deflections, standard_error_nm_rad=known, method=method)


def _chain(
    response: xr.Dataset, n_masses: int, ratio: float, findings: list[str]
) -> dict[str, float]:
    """Return the chain of the response by parameter names of the model."""
    found = fit_chain(response, n_masses, gear_ratio=ratio)
    findings += list(found.findings)
    chain = found.chain
    out = {"J_m": chain.motor_inertia_kg_m2}
    for i, inertia in enumerate(chain.inertia_kg_m2[1:], 1):
        out["J_a" if i == 1 else f"J_a{i}"] = float(inertia)
    # The notch of a cubic spring can look undamped, and a search must not start on the bound.
    least = _LEAST_DAMPING * np.sqrt(chain.stiffness_nm_rad * chain.inertia_kg_m2[1:])
    dampers = np.maximum(chain.damping_nm_s_rad, least)
    for i, (k, d) in enumerate(zip(chain.stiffness_nm_rad, dampers, strict=True), 1):
        out["k1" if i == 1 else f"k1_{i}"] = float(k)
        out["d" if i == 1 else f"d_{i}"] = float(d)
    return out
