"""Standard parameters of a torque model as values of a robot file."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.effects import Effect, effect_info
from axisight.effects.stated import RIGID_BODY_QUANTITIES, RIGID_BODY_TERMS
from axisight.errors import InputError, RobotError
from axisight.rigid_body.regressor import TorqueModel
from axisight.robot_file import Identified, Provenance, identified
from axisight.robot_file.absorbed import absorbed_effects, absorbed_note
from axisight.robot_file.document import INERTIA
from axisight.robot_file.values import noted

Array = NDArray[np.float64]

LINK = 10
ELEMENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def identified_bodies(
    model: TorqueModel,
    theta: ArrayLike,
    provenance: Provenance,
    *,
    covariance: ArrayLike | None = None,
    corner_rad_s: ArrayLike | None = None,
) -> Identified:
    """Return standard parameters in the terms of a robot file, for `write_identified`.

    First moments become centres of mass. Inertias about the link frame become inertias about the
    centre of mass: I_c = I - (|h|^2 1 - h h^T) / m with h = m c. Coulomb friction and torque
    offsets become effects. Effects of the robot whose torque the parameters now include (see
    `axisight.robot_file.absorbed`) are removed, with a note:

    - payload and balancers, which the links now include
    - errors of torque constants, which scale all measured torques
    - friction, offset and rotor inertia of an axis, which the terms of its drive replace

    model
        A model on the motor side, where the robot file has its friction and rotor inertias.
    theta
        (p,) in the order of ``model.names``: ``ConsistentParameters.theta``, or
        ``RigidBodyEstimate.standard()``, whose bodies need not exist (`write_identified`
        refuses those).
    provenance
        Source of the values.
    covariance
        (p, p) of theta, converted to first order; without it standard errors are unknown.
    corner_rad_s
        (n_axes,) motor speeds over which Coulomb friction smooths the sign [rad/s]. Without them the
        effect's default applies, which suits motors and is wide for slides and joints.

    Raises InputError for a model on the joint side and numbers that do not fit the model or are
    not finite, and RobotError for masses that are not positive.
    """
    if model.side != "motor":
        raise InputError(f"model: expected side 'motor', got {model.side!r}")
    values = np.asarray(theta, dtype=np.float64)
    if values.shape != (model.n_parameters,) or not np.isfinite(values).all():
        raise InputError(
            f"theta: expected {model.n_parameters} finite numbers, got shape {values.shape}"
        )
    out = values.copy()
    jacobian = np.eye(len(values))
    names = list(model.names)
    for first in range(0, len(names), LINK):
        joint, _, quantity = names[first].rpartition(".")
        if quantity != "mass":
            break
        link = slice(first, first + LINK)
        if values[first] <= 0:
            raise RobotError(
                f"theta: expected a positive {names[first]}, got {values[first]}: "
                "identify_consistent finds bodies that can exist"
            )
        out[link], jacobian[link, link] = _about_centre(values[link])
        quantities = ("mass", "com_x", "com_y", "com_z", *INERTIA)
        names[link] = [f"{joint}.{quantity}" for quantity in quantities]
    corners = None if corner_rad_s is None else np.asarray(corner_rad_s, dtype=np.float64)
    effects: list[Effect] = []
    for i, name in enumerate(names):
        joint, _, quantity = name.rpartition(".")
        if quantity in RIGID_BODY_TERMS:
            effect, parameter, sign = RIGID_BODY_TERMS[quantity]
            out[i] *= sign
            jacobian[i] *= sign
            axis = _axis(model, joint)
            shape = {} if corners is None else _corner(effect, corners[axis - 1])
            found = Effect(effect, axis, {parameter: float(out[i]), **shape})
            names[i] = f"{found.label}.{parameter}"
            effects.append(found)
    spread = None
    if covariance is not None:
        given = np.asarray(covariance, dtype=np.float64)
        if given.shape != jacobian.shape:
            raise InputError(f"covariance: expected shape {jacobian.shape}, got {given.shape}")
        spread = jacobian @ given @ jacobian.T
        spread = (spread + spread.T) / 2
    replaced = _taken_up(model, effects)
    return identified(
        dict(zip(names, out.tolist(), strict=True)),
        noted(provenance, absorbed_note(replaced)),
        covariance=spread,
        effects=effects,
        removed=replaced,
    )


def _taken_up(model: TorqueModel, found: list[Effect]) -> list[Effect]:
    """Return the effects of the robot that links and drive terms of the model now include."""
    own = model.robot.effects
    out = absorbed_effects(own, ["links", "torque"], axis=None)
    for name in model.names:
        joint, _, quantity = name.rpartition(".")
        if quantity in RIGID_BODY_QUANTITIES:
            axis = _axis(model, joint)
            out += absorbed_effects(own, [RIGID_BODY_QUANTITIES[quantity]], axis=axis, found=found)
    return out


def _corner(effect: str, corner_rad_s: float) -> dict[str, float]:
    """Return the smoothing parameter of an effect, within its bounds; empty for an effect without one."""
    for p in effect_info(effect).parameters:
        if p.name == "smoothing_rad_s":
            return {p.name: float(np.clip(corner_rad_s, p.lower, p.upper))}
    return {}


def _axis(model: TorqueModel, joint: str) -> int:
    """Return the number of the axis, from 1, of a driven joint."""
    driven = [n.removesuffix(".motor_inertia") for n in _rotors(model)]
    return driven.index(joint) + 1


def _rotors(model: TorqueModel) -> list[str]:
    return [n for n in model.robot.parameters() if n.endswith(".motor_inertia")]


def _about_centre(link: Array) -> tuple[Array, Array]:
    """Return mass, centre of mass and inertia about it, and their derivatives by link parameters."""
    mass, h = link[0], link[1:4]
    out, jacobian = link.copy(), np.eye(LINK)
    out[1:4] = h / mass
    jacobian[1:4, 0] = -h / mass**2
    jacobian[1:4, 1:4] = np.eye(3) / mass
    for row, (i, j) in enumerate(ELEMENTS, start=4):
        same = float(i == j)
        moment = same * (h @ h) - h[i] * h[j]
        out[row] -= moment / mass
        jacobian[row, 0] = moment / mass**2
        for k in range(3):
            slope = 2 * same * h[k] - (i == k) * h[j] - (j == k) * h[i]
            jacobian[row, 1 + k] = -slope / mass
    return out, jacobian
