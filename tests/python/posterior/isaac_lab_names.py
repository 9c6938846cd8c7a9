"""Names and arguments of Isaac Lab that the written code uses, and a stand-in that refuses any other.

Read from isaaclab/envs/mdp/events.py, isaaclab/assets/articulation/articulation.py and articulation_data.py of
the series 2.3 (2025). Isaac Lab needs Isaac Sim and a GPU, so the tests do not install it.
"""

from __future__ import annotations

import ast
import inspect

EVENTS = {
    "randomize_joint_parameters": (
        "asset_cfg",
        "friction_distribution_params",
        "armature_distribution_params",
        "lower_limit_distribution_params",
        "upper_limit_distribution_params",
        "operation",
        "distribution",
    ),
    "randomize_rigid_body_mass": (
        "asset_cfg",
        "mass_distribution_params",
        "operation",
        "distribution",
        "recompute_inertia",
        "min_mass",
    ),
}
"""Event functions of ``isaaclab.envs.mdp`` with their arguments behind ``env, env_ids``."""

OPERATIONS, DISTRIBUTIONS = ("add", "scale", "abs"), ("uniform", "log_uniform", "gaussian")
MODES = ("prestartup", "startup", "reset", "interval")

_AT = ("joint_ids", "env_ids")
METHODS = {
    "write_joint_armature_to_sim": ("armature", *_AT),
    "write_joint_friction_coefficient_to_sim": (
        "joint_friction_coeff",
        "joint_dynamic_friction_coeff",
        "joint_viscous_friction_coeff",
        *_AT,
    ),
    "write_joint_viscous_friction_coefficient_to_sim": ("joint_viscous_friction_coeff", *_AT),
    "write_joint_stiffness_to_sim": ("stiffness", *_AT),
    "write_joint_damping_to_sim": ("damping", *_AT),
    "find_joints": ("name_keys", "joint_subset", "preserve_order"),
    "find_bodies": ("name_keys", "preserve_order"),
}
"""Methods of an articulation with their arguments; the first is required."""

ATTRIBUTES = frozenset({"device", "data", "root_physx_view", "actuators", *METHODS})
DATA = frozenset({"default_mass", "default_joint_stiffness", "default_joint_damping"})
ACTUATOR = frozenset({"joint_indices", "is_implicit_model", "stiffness", "damping"})
VIEW = {"get_masses": (), "set_masses": ("data", "indices")}


def bound(name: str, arguments: tuple, given: dict) -> None:
    """Raise TypeError if a method of an articulation does not take these arguments."""
    names = METHODS[name]
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    listed = [
        inspect.Parameter(n, kind, default=inspect.Parameter.empty if k == 0 else None)
        for k, n in enumerate(names)
    ]
    inspect.Signature(listed).bind(*arguments, **given)


def used(text: str) -> dict[str, set[str]]:
    """Return the attributes that code takes from the articulation, its data, its view and an actuator."""
    found: dict[str, set[str]] = {"asset": set(), "data": set(), "view": set(), "actuator": set()}
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Attribute):
            continue
        owner = node.value
        if isinstance(owner, ast.Name) and owner.id in ("asset", "actuator"):
            found[owner.id].add(node.attr)
        elif isinstance(owner, ast.Attribute) and owner.attr == "data":
            found["data"].add(node.attr)
        elif isinstance(owner, ast.Attribute) and owner.attr == "root_physx_view":
            found["view"].add(node.attr)
    return found
