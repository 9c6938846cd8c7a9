"""Which element and attribute of a simulator holds a number, for simulators that have it."""

from __future__ import annotations

from collections.abc import Mapping

from axisight.posterior.randomization.homes import Kind

ENGINES: Mapping[str, Mapping[Kind, str]] = {
    # Fields of mjModel, which MJX and MuJoCo Warp have under the same names.
    "mujoco": {
        "armature": "dof_armature",
        "damping": "dof_damping",
        "frictionloss": "dof_frictionloss",
        "spring": "jnt_stiffness",
        "gear_stiffness": "jnt_stiffness",
        "gear_damping": "dof_damping",
        "mass": "body_mass",
        "inertia": "body_inertia",
        "kp": "actuator_gainprm[0], actuator_biasprm[1]",
        "kd": "actuator_biasprm[2]",
        "torque": "actuator_gainprm[0], actuator_biasprm[1], actuator_biasprm[2]",
        "force_limit": "actuator_forcerange",
    },
    # Arguments of the writers of an articulation, in Isaac Lab 2.3 with Isaac Sim 5.
    "isaaclab": {
        "armature": "write_joint_armature_to_sim: armature",
        "damping": "write_joint_viscous_friction_coefficient_to_sim: joint_viscous_friction_coeff",
        "frictionloss": "write_joint_friction_coefficient_to_sim: joint_friction_coeff, joint_dynamic_friction_coeff",
        "mass": "root_physx_view.set_masses",
        "kp": "write_joint_stiffness_to_sim: stiffness",
        "kd": "write_joint_damping_to_sim: damping",
    },
    # Elements of a robot description, from which Gazebo, Drake and PyBullet build theirs.
    "urdf": {
        "damping": "joint/dynamics@damping",
        "frictionloss": "joint/dynamics@friction",
        "mass": "link/inertial/mass@value",
        "inertia": "link/inertial/inertia",
        "force_limit": "joint/limit@effort",
    },
}
"""Name of the parameter by simulator and kind. A kind that is missing has no parameter there."""


def places_of(kind: Kind) -> dict[str, str]:
    """Return the parameter of every simulator that has one for a kind."""
    return {name: kinds[kind] for name, kinds in ENGINES.items() if kind in kinds}
