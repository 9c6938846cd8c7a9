"""The report of the identification of an arm as text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.graybox.multiaxis.elastic_step import ElasticStep
from axisight.graybox.multiaxis.joint_step import JointStep
from axisight.graybox.multiaxis.rigid_step import RigidStep

UNITS = {
    "stiffness": "Nm/rad",
    "damping": "Nm s/rad",
    "motor_inertia": "kg m^2",
    "viscous_friction": "Nm s/rad",
    "mass": "kg",
    "coulomb_nm": "Nm",
}


def report(
    rigid: RigidStep,
    elastic: ElasticStep,
    joint: JointStep,
    logs: Sequence[str],
    findings: Sequence[str],
) -> str:
    """Return the values of each step, the fit of each log, and findings.

    Arguments are the fields of `RobotIdentification`.
    """
    lines = [*_rigid(rigid), "", *_elastic(elastic), "", *_joint(elastic, joint), ""]
    lines.append("Fit (3.54) of each log, axis by axis, before step 3 -> after")
    rows = zip(logs, joint.initial_fit_percent, joint.fit_percent, strict=True)
    lines += [
        f"  {name}: {_percents(before)} -> {_percents(after)} %" for name, before, after in rows
    ]
    if findings:
        lines += ["", "Findings", *[f"  - {text}" for text in findings]]
    return "\n".join(lines)


def _percents(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def _rigid(step: RigidStep) -> list[str]:
    if step.regression is None:
        return ["Step 1: not performed, no slow log"]
    estimate = step.regression.estimate
    out = ["Step 1: friction from slow motions, by regression"]
    error = np.sqrt(np.diag(estimate.covariance))
    for name, value, std in zip(estimate.base.names, estimate.values, error, strict=True):
        if name.endswith(("viscous_friction", "coulomb_friction")):
            unit = "Nm s/rad" if name.endswith("viscous_friction") else "Nm"
            out.append(_row(name, value, std, unit))
    rest = ", ".join(f"{100 * x:.2g}" for x in estimate.relative_error)
    return [*out, f"  torque left over, by axis: {rest} %"]


def _elastic(step: ElasticStep) -> list[str]:
    if step.fit is None:
        return ["Step 2: not performed"]
    out = [f"Step 2: frequency responses at {len(step.points)} operating points"]
    for point in step.points:
        pose = ", ".join(f"{angle:.3f}" for angle in point.response.joint_angle_rad)
        out.append(
            f"  ({pose}) rad, {len(point.response.frequency_hz)} lines: {', '.join(point.logs)}"
        )
    kept = step.robot.parameters()
    for name, value, std in zip(step.fit.names, step.fit.values, step.fit.std, strict=True):
        if kept[name] == value:
            out.append(_row(name, value, std, _unit(name)))
    return [*out, f"  status: {step.fit.status}, started from {step.start}"]


def _joint(elastic: ElasticStep, step: JointStep) -> list[str]:
    more = {
        "joint encoders": step.joint_weighting,
        "accelerometers": step.acceleration_weighting,
    }
    sensors = ["motors", *(name for name, weighting in more.items() if weighting is not None)]
    out = [f"Step 3: all parameters together, in the time domain, from {' and '.join(sensors)}"]
    before = elastic.robot.parameters()
    for name, value, std in zip(step.fit.names, step.fit.values, step.fit.std, strict=True):
        was = f"   start {before[name]:.4g}" if name in before else ""
        out.append(_row(name, value, std, _unit(name)) + was)
    return [*out, f"  status: {step.fit.status}, {step.passes} passes"]


def _unit(name: str) -> str:
    return UNITS.get(name.rpartition(".")[2], "")


def _row(name: str, value: float, std: float, unit: str) -> str:
    return f"  {name:<34} {value:>11.4g} ± {std:<9.2g} {unit}"
