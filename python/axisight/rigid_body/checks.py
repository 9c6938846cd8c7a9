"""Plausibility checks of an estimate: conditioning, signs of friction and inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.least_squares import Factors
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.statistics.least_squares import unit_columns

Array = NDArray[np.float64]

# Published advice for excitation is a condition number below 100. Ten times that loses one digit more
# than most torque measurements have.
MOST_CONDITION = 1e3
# A value counts as negative if it is below zero by this many standard errors.
CLEARLY = 3.0
# With fewer degrees of freedom a standard deviation is itself uncertain by at least 40 %.
LEAST_FREEDOM = 3.0
# Number of samples at which the check evaluates inertias.
LOOKS = 50


def condition(result: RigidBodyEstimate) -> list[IdentificationFinding]:
    """Return a finding if the scaled regressor is badly conditioned."""
    number = result.condition_number_scaled
    if number < MOST_CONDITION:
        return []
    worst = np.argsort(-np.nan_to_num(result.relative_standard_error, posinf=0.0))[:3]
    names = tuple(result.names[i] for i in worst)
    text = (
        f"condition number {number:.2g} of the scaled regressor: expected below "
        f"{MOST_CONDITION:g}; least certain are {', '.join(names)}. Optimize the trajectory, fix "
        "what is known, or eliminate"
    )
    return [IdentificationFinding(FindingKind.CONDITION, text, names=names)]


def freedom(result: RigidBodyEstimate) -> list[IdentificationFinding]:
    """Return a finding if standard errors come from few blocks; intervals allow for that."""
    advice = "take interval(), which counts them, longer data or more blocks"
    return few_degrees(result.names, result.degrees_of_freedom, advice, serious=False)


def few_degrees(
    names: list[str], degrees: Array, advice: str, *, serious: bool
) -> list[IdentificationFinding]:
    """Return a finding if standard errors have fewer than three degrees of freedom.

    ``degrees`` (n,) belong to ``names``; ``advice`` ends the message.
    """
    few = tuple(name for name, d in zip(names, degrees, strict=True) if d < LEAST_FREEDOM)
    if not few:
        return []
    text = (
        f"standard errors of {', '.join(few[:3])}{' and others' if len(few) > 3 else ''}: expected "
        f"{LEAST_FREEDOM:g} or more degrees of freedom, got {degrees.min():.2g}; {advice}"
    )
    return [IdentificationFinding(FindingKind.FREEDOM, text, serious, few)]


def friction_sign(result: RigidBodyEstimate) -> list[IdentificationFinding]:
    """Return a finding for every friction that is negative by more than CLEARLY standard errors."""
    out = []
    names = zip(result.names, result.values, result.standard_error, strict=True)
    for name, value, error in names:
        quantity = name.split(".")[-1]
        is_friction = quantity.endswith(("viscous_friction", "coulomb_friction"))
        if is_friction and value < -CLEARLY * error and value < 0:
            text = (
                f"{name}: expected a friction not below zero, got {value:.3g} +- {error:.2g}; look "
                "for a delay between motion and torque, or a wrong sign of one of them"
            )
            out.append(IdentificationFinding(FindingKind.NEGATIVE_FRICTION, text, names=(name,)))
    return out


def gear_sign(
    result: RigidBodyEstimate, factors: Factors, motion: tuple[Array, Array, Array]
) -> list[IdentificationFinding]:
    """Return a finding for every axis whose torque opposes its acceleration.

    The check fits each axis alone and computes its own inertia at poses of the data. That inertia is
    negative if gear ratio, angle or torque of the axis has the wrong sign, whatever the other axes do.
    """
    model = result.model
    if model.side == "base":
        return []
    joints = model.axis_coordinates
    q = motion[0][:: max(1, len(motion[0]) // LOOKS)]
    # Unit acceleration of each motor (or joint) alone, and one row without acceleration.
    units = np.zeros((len(joints) + 1, model.n_coordinates))
    alone = np.linalg.inv(model.coupling.position).T
    units[:-1, joints] = alone if model.side == "motor" else np.eye(len(joints))
    at = np.tile(q, (len(units), 1))
    still = np.zeros_like(at)
    looks = model.matrix(at, still, np.repeat(units, len(q), axis=0))
    looks = looks.reshape(len(units), len(q), model.n_rows, model.n_parameters).mean(axis=1)
    held = np.array([result.known.get(name, 0.0) for name in model.names])
    out = []
    for axis, joint in enumerate(joints):
        row = model.n_base_rows + (axis if model.side == "motor" else joint - model.first_joint)
        inertia = (looks[axis] - looks[-1])[row]
        known_part = float(inertia @ held)
        value, error = _axis_alone(factors, row, inertia[result.base.columns])
        if value + known_part < -CLEARLY * error:
            name = model.coordinate_names[joint]
            text = (
                f"{name}: by itself its torque wants a negative inertia, {value + known_part:.3g} "
                f"+- {error:.2g} kg m^2: torque and acceleration have opposite signs. Check the "
                "sign of its gear ratio, of its angle and of its torque"
            )
            out.append(IdentificationFinding(FindingKind.GEAR_SIGN, text, names=(name,)))
    return out


def _axis_alone(factors: Factors, row: int, direction: Array) -> tuple[float, float]:
    """Return value and standard error of a combination, from the least-norm solution of one row."""
    k = factors.k
    r = factors.rows[row]
    unit, scale = unit_columns(r[:, :k])
    u, s, vt = np.linalg.svd(unit, full_matrices=False)
    good = s > 1e-6 * s.max(initial=0.0)
    weight = (vt[good] @ (direction / scale)) / s[good]
    value = float(weight @ (u[:, good].T @ r[:, k]))
    rest = r[:, k] - u[:, good] @ (u[:, good].T @ r[:, k])
    free = max(float(factors.counts[row]) - int(good.sum()), 1.0)
    error = float(np.linalg.norm(weight) * np.sqrt(rest @ rest / free))
    return value, error
