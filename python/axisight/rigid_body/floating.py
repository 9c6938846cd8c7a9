"""Identification of robots with a floating base: six equations of the base beside those of the joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import one_of, positive
from axisight.errors import InputError
from axisight.rigid_body.contact import contact_check, refuse_contact
from axisight.rigid_body.coordinates import floating_motion
from axisight.rigid_body.estimate import identify_rigid_body, row_weights
from axisight.rigid_body.regressor import TorqueModel, rows
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.robot import BaseMotion, Robot

Array = NDArray[np.float64]

STANDARD_GRAVITY_M_S2 = 9.81
"""Acceleration of the sample that stands for a scale; the result does not depend on it."""


def identify_floating(
    robot: Robot | TorqueModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    base: BaseMotion,
    torque_nm: ArrayLike | None = None,
    *,
    wrench: ArrayLike | None = None,
    mass_kg: float | None = None,
    sample_time_s: float | None = None,
    contact: str = "refuse",
    **options: Any,
) -> RigidBodyEstimate:
    """Return estimated base parameters of a robot with a floating base, in the air or on a stand.

    Parameters
    ----------
    robot : the robot, or a :class:`TorqueModel` of it.
    q, v, a : (n, n_joints) joint angles, velocities, accelerations [rad, rad/s, rad/s^2].
    base : motion of the base, n rows.
    torque_nm : (n, n_joints) joint torques or (n, n_axes) motor torques [Nm], by the ``side`` of the model.
        Without them, only the six equations of the base count (``side="base"``). They need a measured ``wrench``
        or the ``mass_kg``, because in free flight they hold for any common factor of all masses and inertias.
    wrench : (n, 6) measured external force [N] and moment [Nm] on the base, in its axes about its origin, for
        example of a load cell in the stand; default zero, free flight.
    mass_kg : mass of the whole robot [kg], from a scale. It counts as much as all samples of the log together.
    sample_time_s : sample time [s], for the times in the message of a ContactError; default that of the robot.
    contact : ``"refuse"``: raise ContactError if the wrench on the base differs from ``wrench`` by more than the
        nominal model and the noise allow (:func:`contact_check`); ``"keep"``: use all samples.
    options : arguments of :class:`TorqueModel` and further ones of :func:`identify_rigid_body`. With ``hung_at_m``,
        the robot hangs on an unmeasured force at this point, and only the moments about it count.

    The equations of the base have no friction and no torque constants. They give the inertias of all links up to a
    common scale, and the torques of the joints give the scale.

    Raises InputError as :func:`identify_rigid_body` and :func:`floating_motion`, and ContactError.

    """
    one_of("contact", contact, ("refuse", "keep"))
    if isinstance(robot, TorqueModel):
        model = robot
    else:
        names = ("terms", "side", "coupling", "hung_at_m")
        chosen = {name: options.pop(name) for name in names if name in options}
        if torque_nm is None:
            chosen.setdefault("side", "base")
        model = TorqueModel(robot, **chosen)
    motion = floating_motion(model.robot, q, v, a, base)
    n = len(motion[0])
    outside = np.zeros((n, 6)) if wrench is None else rows("wrench", wrench, 6)
    if len(outside) != n:
        raise InputError(f"wrench: expected {n} rows as q, got {len(outside)}")
    target = _target(model, outside, torque_nm)
    if contact == "refuse":
        found = contact_check(
            model.robot,
            q,
            v,
            a,
            base,
            wrench=outside,
            hung_at_m=model.hung_at_m,
            sample_time_s=sample_time_s,
        )
        refuse_contact(found)
    if mass_kg is not None and model.n_base_rows < 6:
        raise InputError("mass_kg: expected none with hung_at_m, whose equations have no force")
    if mass_kg is not None:
        weight = row_weights(options.pop("sample_weight", None), target.shape)
        motion, target, options["sample_weight"] = _weighed(
            model, motion, target, weight, positive("mass_kg", mass_kg)
        )
    elif not target.any():
        raise InputError(
            "mass_kg: expected the mass of the whole robot, or torques, or a measured wrench, got none: in free "
            "flight the equations of the base hold for any common factor of all masses and inertias"
        )
    return identify_rigid_body(model, *motion, target, **options)


def _target(model: TorqueModel, outside: Array, torque_nm: ArrayLike | None) -> Array:
    """Return what the rows of a model have to equal: the external wrench, and the torques of its side."""
    base = outside @ model.base_map.T
    if model.side == "base":
        if torque_nm is not None:
            raise InputError('torque_nm: expected none with side="base", got torques')
        return base
    if torque_nm is None:
        raise InputError(f'torque_nm: expected torques with side="{model.side}", got none')
    torque = rows("torque_nm", torque_nm, model.n_rows - model.n_base_rows)
    if len(torque) != len(base):
        raise InputError(f"torque_nm: expected {len(base)} rows as q, got {len(torque)}")
    return np.hstack([base, torque])


def _weighed(
    model: TorqueModel,
    motion: tuple[Array, Array, Array],
    target: Array,
    weight: Array | None,
    mass_kg: float,
) -> tuple[tuple[Array, Array, Array], Array, Array]:
    """Return motion, target and weights with one more sample: at rest, on a scale.

    Only the three equations of the force count there, in which the total mass is the only parameter.
    """
    n = len(target)
    q, v, a = (np.vstack([x, np.zeros((1, x.shape[1]))]) for x in motion)
    # Along all three axes of the base, so that no row weight decides.
    a[-1, :3] = STANDARD_GRAVITY_M_S2 / np.sqrt(3.0)
    forces = np.zeros((1, target.shape[1]))
    forces[0, :3] = mass_kg * a[-1, :3]
    counted = np.zeros((1, target.shape[1]))
    counted[0, :3] = np.sqrt(n)
    before = np.ones_like(target) if weight is None else weight
    return (q, v, a), np.vstack([target, forces]), np.vstack([before, counted])
