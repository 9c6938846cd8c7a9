"""Differences between an imported robot's inverse dynamics and those of the format's own library."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pinocchio
from numpy.typing import NDArray

from axisight import Robot

Array = NDArray[np.float64]


def states(robot: Robot, count: int) -> tuple[Array, Array, Array]:
    """Return random positions, speeds and accelerations (count, n_joints)."""
    random = np.random.default_rng(1)
    shape = (count, robot.n_joints)
    return random.uniform(-3, 3, shape), random.normal(size=shape), 3 * random.normal(size=shape)


def difference_to_pinocchio(robot: Robot, model: Any, count: int = 1000) -> float:
    """Return the largest difference to Pinocchio at random states, relative to the largest force.

    Joints of the model that the robot lacks stay at zero.
    """
    data = model.createData()
    joints = [model.joints[model.getJointId(name)] for name in robot.joint_names]
    speeds = [joint.idx_v for joint in joints]
    q, v, a = states(robot, count)
    wanted = np.empty_like(q)
    for k in range(count):
        configuration = pinocchio.neutral(model)
        for joint, angle in zip(joints, q[k], strict=True):
            if joint.nq == 2:
                configuration[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
            else:
                configuration[joint.idx_q] = angle
        rates, accelerations = np.zeros(model.nv), np.zeros(model.nv)
        rates[speeds], accelerations[speeds] = v[k], a[k]
        wanted[k] = pinocchio.rnea(model, data, configuration, rates, accelerations)[speeds]
    # Rotors are not part of rnea, except those that the model states as armature.
    wanted -= a * np.array(model.armature)[speeds]
    return float(np.abs(robot.inverse_dynamics(q, v, a) - wanted).max() / np.abs(wanted).max())


def difference_to_mujoco(robot: Robot, model: Any, count: int = 1000) -> float:
    """Return the largest difference to MuJoCo, without its drives, springs and contacts."""
    for quantity in (model.dof_armature, model.dof_damping, model.dof_frictionloss):
        quantity[:] = 0
    model.jnt_stiffness[:] = 0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    kind = mujoco.mjtObj.mjOBJ_JOINT
    joints = [mujoco.mj_name2id(model, kind, name) for name in robot.joint_names]
    angles, speeds = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    plain = model.jnt_qposadr[np.isin(model.jnt_type, [2, 3])]
    q, v, a = states(robot, count)
    wanted = np.empty_like(q)
    for k in range(count):
        data.qpos[:] = model.qpos0
        data.qpos[plain] = 0.0
        data.qvel[:], data.qacc[:] = 0.0, 0.0
        data.qpos[angles], data.qvel[speeds], data.qacc[speeds] = q[k], v[k], a[k]
        mujoco.mj_inverse(model, data)
        wanted[k] = data.qfrc_inverse[speeds]
    return float(np.abs(robot.inverse_dynamics(q, v, a) - wanted).max() / np.abs(wanted).max())
