"""Identification of robots with a floating base: six equations of the base beside those of the joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import one_of
from axisight.errors import InputError
from axisight.rigid_body.contact import refuse_contact
from axisight.rigid_body.coordinates import floating_motion
from axisight.rigid_body.estimate import identify_rigid_body
from axisight.rigid_body.regressor import TorqueModel, rows
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.robot import BaseMotion, Robot

Array = NDArray[np.float64]


def identify_floating(
    robot: Robot | TorqueModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    base: BaseMotion,
    torque_nm: ArrayLike | None = None,
    *,
    wrench: ArrayLike | None = None,
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
        Without them, only the six equations of the base count (``side="base"``). They need a measured ``wrench``,
        or a known parameter for the scale, such as ``known={"base.mass": 12.3}``.
    wrench : (n, 6) measured external force [N] and moment [Nm] on the base, in its axes about its origin, for
        example of a load cell in the stand; default zero, free flight.
    sample_time_s : sample time [s], for the times in the message of a ContactError; default that of the robot.
    contact : ``"refuse"``: raise ContactError if the wrench on the base differs from ``wrench`` by more than the
        nominal model and the noise allow (:func:`contact_check`); ``"keep"``: use all samples.
    options : further arguments of :func:`identify_rigid_body`.

    The equations of the base have no friction and no torque constants. They give the inertias of all links up to a
    common scale, and the torques of the joints give the scale.

    Raises InputError as :func:`identify_rigid_body` and :func:`floating_motion`, and ContactError.

    """
    one_of("contact", contact, ("refuse", "keep"))
    if isinstance(robot, TorqueModel):
        model = robot
    else:
        chosen = {k: options.pop(k) for k in ("terms", "side", "coupling") if k in options}
        if torque_nm is None:
            chosen.setdefault("side", "base")
        model = TorqueModel(robot, **chosen)
    motion = floating_motion(model.robot, q, v, a, base)
    n = len(motion[0])
    outside = np.zeros((n, 6)) if wrench is None else rows("wrench", wrench, 6)
    if len(outside) != n:
        raise InputError(f"wrench: expected {n} rows as q, got {len(outside)}")
    target = outside
    if model.side == "base":
        if torque_nm is not None:
            raise InputError('torque_nm: expected none with side="base", got torques')
    elif torque_nm is None:
        raise InputError(f'torque_nm: expected torques with side="{model.side}", got none')
    else:
        torque = rows("torque_nm", torque_nm, model.n_rows - 6)
        if len(torque) != n:
            raise InputError(f"torque_nm: expected {n} rows as q, got {len(torque)}")
        target = np.hstack([outside, torque])
    if contact == "refuse":
        step = model.robot.sample_time_s if sample_time_s is None else sample_time_s
        refuse_contact(model.robot, q, v, a, base, wrench=outside, sample_time_s=step)
    return identify_rigid_body(model, *motion, target, **options)
