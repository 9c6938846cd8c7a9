"""The fit of one axis as values of a robot file, and as effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import instance
from axisight.effects import Effect
from axisight.effects.stated import of_axis_fit
from axisight.errors import InputError
from axisight.fitting import robot_parameters
from axisight.graybox.axis_result import AxisFit
from axisight.robot import Robot
from axisight.robot_file import Identified, Provenance
from axisight.robot_file.absorbed import absorbed_effects, absorbed_note
from axisight.robot_file.sidecar import known
from axisight.robot_file.values import noted, values_of

Array = NDArray[np.float64]
Covariance = Literal["trusted", "sandwich", "white"]

# Quantity of the robot file by thesis name.
QUANTITIES = {
    "J_m": "motor_inertia",
    "F_v": "viscous_friction",
    "k1": "stiffness",
    "d": "damping",
}
EXACT_SIGN_SMOOTHING_RAD_S = 0.01
"""Smoothing of effects for a fit with the exact sign of friction, as in the preset of the thesis."""
# Quantities that a fitted axis replaces, so that the robot's own effects on them are removed.
STANDS_FOR = (
    "motor_inertia",
    "viscous_friction",
    "dry_friction",
    "torque_offset",
    "stiffness",
    "damping",
    "backlash",
    "torque",
)


def identified_axis(
    fit: AxisFit,
    robot: Robot,
    provenance: Provenance,
    *,
    axis: int | str = 1,
    covariance: Covariance = "trusted",
    smoothing_rad_s: float | None = None,
) -> Identified:
    """Return the fit of one axis in the terms of a robot file, for `write_identified`.

    ========================= ==================================================================
    thesis                    robot file, joint of the axis
    ========================= ==================================================================
    ``J_m``, ``F_v``          ``motor_inertia``, ``viscous_friction`` (motor side)
    ``k1``, ``d``             ``stiffness``, ``damping`` (joint side)
    ``k3``                    effect ``nonlinear_stiffness``
    ``F_c``; ``F_s``, ``v_s`` effect ``coulomb_friction``, or with ``F_s`` ``stribeck_friction``
    ``b``, ``u_0``            effects ``backlash``, ``torque_offset``
    ``a_n``, ``b_n``          effect ``torque_ripple``, up to three orders
    ``J_a``, ``J_a2`` ...     none: the inertia of an arm belongs to all links beyond the joint
    ``k1_2``, ``d_2`` ...     none: one axis does not tell which elastic joint they belong to
    ``F_a``, ``r``            none
    ========================= ==================================================================

    The provenance's settings hold values without a place in the file under ``"no_place"``, with unit
    and standard error, and the notes name them. For the inertia of the arm the notes also give the
    robot's inertia about the joint at its operating point. Warnings and status of the fit are notes
    too.

    fit
        A fit of two to four masses. Motor-side data determine an axis up to the gear ratio. If the
        fit's ratio (1, or a fitted ``r``) differs from the robot's, joint-side values are converted
        so that the motor moves alike: k1, d, J_a by (r_fit / r_robot)^2, k3 by the fourth power, b by
        the inverse.
    robot
        The robot to which the values will be written. The fit replaces its friction and gear effects
        at the axis, so those that the fit does not have are removed.
    provenance
        Source of the values.
    axis
        Number of the axis from 1, or the name of its joint.
    covariance
        Covariance of the fit to use: ``"trusted"`` (named by its ``trusted``), ``"sandwich"`` or
        ``"white"``, converted to first order. A sandwich of few blocks is unknown, and standard errors
        are then unknown too. The notes name the covariance. A value held in the fit is written, with
        standard error zero and a note, if it differs from the robot's.
    smoothing_rad_s
        Width [rad/s] over which friction effects smooth the sign; by default that of the model, or
        0.01 rad/s for a model with the exact sign.

    Raises InputError for another type, an axis that does not exist or has a rigid transmission, and
    a width that is not positive.
    """
    if not isinstance(fit, AxisFit):
        raise InputError(f"fit: expected an AxisFit, got {type(fit).__name__}")
    axis = instance("robot", robot, Robot).axis_number(axis)
    joint, ratio = joint_of(robot, axis)
    spread, kind = _spread(fit, covariance)
    width = _width(fit, smoothing_rad_s)
    values, slopes = converted(fit, ratio)
    effects, owner = _effects(fit, values, axis, width)
    names, held = _places(fit, robot, joint, values, slopes, owner)
    unplaced = _unplaced(fit, values, slopes, spread, {*QUANTITIES, *owner})
    replaced = absorbed_effects(robot.effects, STANDS_FOR, axis=axis, found=effects)
    notes = [kind, *_notes(fit, robot, joint, ratio, unplaced)]
    if held:
        notes.append(f"held in the fit: {', '.join(held)}")
    notes += absorbed_note(replaced)
    if not fit.model.friction_smoothing_rad_s and any("F_" in n for n in owner):
        notes.append(f"the exact sign of the fit's friction is smoothed over {width:g} rad/s")
    return values_of(
        {place: values[name] for name, place in names.items()},
        np.array([slopes[name] for name in names]).reshape(len(names), len(fit.free)),
        spread,
        noted(provenance, [*notes, f"search: {fit.status}", *fit.warnings], unplaced),
        effects=effects,
        removed=replaced,
    )


def _spread(fit: AxisFit, covariance: Covariance) -> tuple[Array, str]:
    """Return the covariance of the free parameters, and a note on its kind."""
    if covariance not in ("trusted", "sandwich", "white"):
        raise InputError(f"covariance: expected trusted, sandwich or white, got {covariance!r}")
    kind = fit.trusted if covariance == "trusted" else covariance
    if kind == "white":
        text = "standard errors: of white prediction errors of one variance"
        matrix = fit.covariance
    else:
        text = f"standard errors: sandwich of {fit.blocks} blocks"
        matrix = fit.sandwich
        if not np.isfinite(matrix).any():
            text += ", too few: unknown"
    other = "" if kind == fit.trusted else f"; the fit trusts the other kind ({fit.trusted})"
    return matrix, text + other


def _places(
    fit: AxisFit,
    robot: Robot,
    joint: str,
    values: Mapping[str, float],
    slopes: Mapping[str, Array],
    owner: Mapping[str, str],
) -> tuple[dict[str, str], list[str]]:
    """Return the robot-file names of written values by thesis name, and the names of held values."""
    present = robot_parameters(robot)
    names: dict[str, str] = {}
    held = []
    for name, value in values.items():
        place = f"{joint}.{QUANTITIES[name]}" if name in QUANTITIES else owner.get(name)
        if place is None:
            continue
        if name not in fit.free:
            if present.get(place) == value and not slopes[name].any():
                continue
            held.append(name)
        names[name] = place
    return names, held


def _same_ratio(own: float, ratio: float) -> bool:
    """Return whether two gear ratios differ by rounding only, relative to their small size."""
    return bool(np.isclose(own, ratio, rtol=1e-12, atol=0.0))


def joint_of(robot: Robot, axis: int | str) -> tuple[str, float]:
    """Return the joint name of an axis and the size of its gear ratio; raises InputError without spring."""
    axis = robot.axis_number(axis)
    joint = robot.axis_names[axis - 1]
    if f"{joint}.stiffness" not in robot_parameters(robot):
        raise InputError(
            f"axis: expected one with a gear spring, got {axis}: {joint} has a rigid transmission; "
            "give it a stiffness and a damping in the robot file"
        )
    return joint, abs(float(robot.gear_ratio[axis - 1]))


def _width(fit: AxisFit, given: float | None) -> float:
    own = fit.model.friction_smoothing_rad_s or EXACT_SIGN_SMOOTHING_RAD_S
    width = own if given is None else given
    if isinstance(width, bool) or not (np.isfinite(width) and width > 0):
        raise InputError(f"smoothing_rad_s: expected a positive number, got {given!r}")
    return float(width)


def _power(name: str) -> int:
    """Return the power of the gear ratio that keeps the motor's motion unchanged."""
    if name == "b":
        return -1
    if name.startswith("k3"):
        return 4
    return 2 if name.startswith(("k1", "d", "J_a")) else 0


def converted(fit: AxisFit, ratio: float) -> tuple[dict[str, float], dict[str, Array]]:
    """Return all values for the robot's gear ratio, and their derivatives (n_free,) by the free ones."""
    own = fit.parameters["r"]
    values, slopes = {}, {}
    for name, value in fit.parameters.items():
        power = _power(name)
        factor = 1.0 if _same_ratio(own, ratio) else (own / ratio) ** power
        values[name] = value * factor
        slope = np.zeros(len(fit.free))
        if name in fit.free:
            slope[fit.free.index(name)] = factor
        if power and "r" in fit.free:
            slope[fit.free.index("r")] = power * value * factor / own
        slopes[name] = slope
    return values, slopes


def _effects(
    fit: AxisFit, values: Mapping[str, float], axis: int, width: float
) -> tuple[list[Effect], dict[str, str]]:
    """Return the effects of the fit, and the full names of effect parameters by thesis name."""
    table = of_axis_fit(
        stribeck=fit.model.stribeck,
        ripple_orders=fit.model.ripple_orders,
        smoothing_rad_s=width,
    )
    effects: list[Effect] = []
    owner: dict[str, str] = {}
    for stated in table:
        used = {n: p for n, p in stated.places.items() if n in values}
        if not any(n in fit.free or values[n] for n in used if n != "v_s"):
            continue
        found = {p: values[n] for n, p in used.items()}
        effect = Effect(stated.name, axis, stated.shape | found)
        effects.append(effect)
        owner |= {n: f"{effect.label}.{p}" for n, p in used.items()}
    return effects, owner


def _unplaced(
    fit: AxisFit,
    values: Mapping[str, float],
    slopes: Mapping[str, Array],
    spread: Array,
    placed: set[str],
) -> dict[str, Any]:
    """Return values without a place in the file, for the robot's gear ratio, with error, unit, meaning."""
    out: dict[str, Any] = {}
    for p in fit.model.parameters:
        free = p.name in fit.free
        if p.name in placed or not (free or (values[p.name] and p.name not in ("r", "v_s"))):
            continue
        used = np.flatnonzero(slopes[p.name])
        variance = slopes[p.name][used] @ spread[np.ix_(used, used)] @ slopes[p.name][used]
        out[p.name] = {
            "value": float(values[p.name]),
            "standard_error": known(float(np.sqrt(variance))) if used.size else None,
            "unit": p.unit,
            "meaning": p.meaning,
        }
    return out


def _notes(
    fit: AxisFit, robot: Robot, joint: str, ratio: float, unplaced: Mapping[str, Any]
) -> list[str]:
    notes = []
    arm = {n: v["value"] for n, v in unplaced.items() if n.startswith("J_a")}
    if arm:
        listed = " + ".join(f"{n} {v:.6g}" for n, v in arm.items())
        notes.append(
            f"not written: {listed} kg m^2, which a chain holds in the links beyond {joint}; the "
            f"robot has {inertia_about(robot, joint):.6g} there at its operating point"
        )
    others = [n for n in unplaced if n not in arm]
    if others:
        notes.append(f"not written, no place in a robot file: {', '.join(others)}")
    own = fit.parameters["r"]
    if not _same_ratio(own, ratio):
        notes.append(f"converted from the gear ratio {own:.9g} of the fit to {ratio:.9g}")
    return notes


def inertia_about(robot: Robot, joint: str) -> float:
    """Return the inertia of all links beyond a joint at the operating point [kg m^2]."""
    q = np.zeros(robot.n_joints)
    q[robot.axis_joints] = robot.operating_point
    place = robot.joint_names.index(joint)
    return float(robot.inertia_matrix(q)[place, place])
