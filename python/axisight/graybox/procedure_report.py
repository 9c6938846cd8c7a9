"""The report of the three-step procedure as text."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.graybox.axis_model import AxisModel
from axisight.graybox.axis_result import AxisFit
from axisight.graybox.first_steps import InitialModel
from axisight.graybox.flexibilities import CubicSpring, Flexibility
from axisight.graybox.step_one import RigidBodyFriction
from axisight.graybox.validation import ResidualTests


def report(
    names: Sequence[str],
    model: AxisModel,
    initial: InitialModel,
    fit: AxisFit,
    initial_fit_percent: Sequence[float],
    tests: Sequence[ResidualTests],
) -> str:
    """Return the values of each step, fits, tests and findings.

    ``names`` are those of the data sets, the low-frequency one first. The other arguments are those of
    `AxisIdentification`.
    """
    lines = [*_step_one(initial.rigid), ""]
    for name, one in zip(names[1:], initial.flexibilities, strict=False):
        lines += _step_two(name, one)
    if initial.spring is not None:
        lines += _spring(initial.spring)
    lines += ["", "Step 3: prediction-error fit"]
    units = {p.name: p.unit for p in model.parameters}
    for name, value, own in zip(fit.free, fit.values, fit.standard_error, strict=True):
        start = initial.start.get(name)
        was = "" if start is None else f"   start {start:.4g}"
        lines.append(_row(name, float(value), float(own), units[name]) + was)
    lines.append(f"  status: {fit.status}, {fit.iterations} iterations")
    lines += ["", "Fit (3.54), initial -> final, and residual tests"]
    rows = zip(names, initial_fit_percent, fit.fit_percent, tests, strict=True)
    for name, before, after, test in rows:
        lines.append(f"  {name}: {before:.1f} % -> {after:.1f} %; {test.verdict}")
    notes = [*initial.findings, *fit.warnings]
    if notes:
        lines += ["", "Findings", *[f"  - {text}" for text in notes]]
    return "\n".join(lines)


def _step_one(rigid: RigidBodyFriction) -> list[str]:
    return [
        f"Step 1: rigid body and friction, below {rigid.cutoff_hz:g} Hz",
        _row("J", rigid.inertia_kg_m2, rigid.inertia_standard_error, "kg m^2 (J_m + r^2 J_a)"),
        _row(
            "F_v",
            rigid.viscous_friction_nm_s_rad,
            rigid.viscous_friction_standard_error,
            "Nm s/rad",
        ),
        _row("F_c", rigid.coulomb_friction_nm, rigid.coulomb_friction_standard_error, "Nm"),
        f"  residual {rigid.residual_rms_nm:.3g} Nm rms, fit {rigid.fit_percent:.1f} %",
    ]


def _step_two(name: str, one: Flexibility) -> list[str]:
    notch = one.notch
    return [
        f"Step 2, {name}: flexibility from the frequency response",
        _row("w_n", notch.frequency_rad_s, notch.frequency_standard_error_rad_s, "rad/s (notch)"),
        _row(
            "w_r",
            one.resonance.frequency_rad_s,
            one.resonance.frequency_standard_error_rad_s,
            "rad/s (resonance)",
        ),
        _row("J_m", one.motor_inertia_kg_m2, one.motor_inertia_standard_error, "kg m^2"),
        _row("J_a", one.arm_inertia_kg_m2, one.arm_inertia_standard_error, "kg m^2"),
        _row("k", one.stiffness_nm_rad, one.stiffness_standard_error, "Nm/rad"),
        _row("d", one.damping_nm_s_rad, one.damping_standard_error, "Nm s/rad"),
    ]


def _spring(spring: CubicSpring) -> list[str]:
    rms = ", ".join(f"{1e3 * x:.2f}" for x in spring.deflection_rms_rad)
    return [
        f"Step 2, spring from deflections of {rms} mrad rms",
        _row("k1", spring.linear_nm_rad, spring.linear_standard_error, "Nm/rad"),
        _row("k3", spring.cubic_nm_rad3, spring.cubic_standard_error, "Nm/rad^3"),
    ]


def _row(name: str, value: float, deviation: float, unit: str) -> str:
    return f"  {name:<5} {value:>11.4g} ± {deviation:<9.2g} {unit}"
