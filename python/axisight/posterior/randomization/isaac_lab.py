"""Code for Isaac Lab: an event configuration with ranges, and an event that draws correlated numbers together."""

from __future__ import annotations

from axisight.posterior.randomization.fields import RandomizedField
from axisight.posterior.randomization.layout import Layout, mode_of, plain

_IMPORTS = """
import re

{torch}from isaaclab.envs import mdp
from isaaclab.managers import EventTermCfg as EventTerm
from isaaclab.managers import SceneEntityCfg
from isaaclab.utils import configclass

"""

_DRAW = '''

def _draw(number, device):
    """Return values of the numbers that are drawn together, (number, len(TOGETHER))."""
    weights = torch.tensor(WEIGHTS, device=device)
    which = torch.multinomial(weights, number, replacement=True)
    means, roots = torch.tensor(MEANS, device=device), torch.tensor(ROOTS, device=device)
    normal = torch.randn(number, len(TOGETHER), 1, device=device)
    values = means[which] + (roots[which] @ normal)[:, :, 0]
    return values.clamp(torch.tensor(LOW, device=device), torch.tensor(HIGH, device=device))


def draw_together(env, env_ids, asset_cfg=SceneEntityCfg("robot")):
    """Draw the correlated numbers of each environment together, and write them into the simulation.

    Friction is an effort [Nm] and a viscous coefficient from Isaac Sim 5 on.
    """
    asset = env.scene[asset_cfg.name]
    if env_ids is None:
        env_ids = torch.arange(env.scene.num_envs, device=asset.device)
    values = dict(zip(TOGETHER, _draw(len(env_ids), asset.device).T, strict=True))

    def columns(kind, names):
        """Return the places of the joints or bodies of a kind, and its values (n_envs, n_places)."""
        joints = [j for k, j in values if k == kind]
        find = asset.find_bodies if names is BODIES else asset.find_joints
        places = [find(re.escape(names[j]))[0][0] for j in joints]
        return places, torch.stack([values[kind, j] for j in joints], dim=1)

'''

_ARMATURE = """    places, found = columns("armature", DRIVES)
    asset.write_joint_armature_to_sim(found, joint_ids=places, env_ids=env_ids)
"""
_FRICTION = """    places, found = columns("frictionloss", DRIVES)
    asset.write_joint_friction_coefficient_to_sim(
        found, joint_dynamic_friction_coeff=found, joint_ids=places, env_ids=env_ids
    )
"""
_DAMPING = """    places, found = columns("damping", DRIVES)
    asset.write_joint_viscous_friction_coefficient_to_sim(found, joint_ids=places, env_ids=env_ids)
"""
_MASS = """    places, found = columns("mass", BODIES)
    masses, nominal, on_cpu = asset.root_physx_view.get_masses(), asset.data.default_mass, env_ids.cpu()
    masses[on_cpu[:, None], places] = nominal[on_cpu[:, None], places] * found.cpu()
    asset.root_physx_view.set_masses(masses, on_cpu)
"""
_GAINS = """    for kind, gain in (("kp", "stiffness"), ("kd", "damping")):
        if not any(k == kind for k, _ in values):
            continue
        places, found = columns(kind, ACTUATORS)
        wanted = getattr(asset.data, f"default_joint_{gain}")[env_ids].clone()
        wanted[:, places] *= found
        for actuator in asset.actuators.values():
            mine = actuator.joint_indices
            getattr(actuator, gain)[env_ids] = wanted[:, mine]
            if actuator.is_implicit_model:
                write = getattr(asset, f"write_joint_{gain}_to_sim")
                write(wanted[:, mine], joint_ids=mine, env_ids=env_ids)
"""

_WRITERS = (
    (("armature",), _ARMATURE),
    (("frictionloss",), _FRICTION),
    (("damping",), _DAMPING),
    (("mass",), _MASS),
    (("kp", "kd"), _GAINS),
)


def isaac_lab(layout: Layout) -> str:
    """Return the code: ``AxisightEvents``, a configuration of events for the manager of an environment."""
    used = [layout.fields.every[i] for i in layout.fields.together]
    parts = [layout.head(), _IMPORTS.format(torch="import torch\n" if used else "")]
    parts += [layout.names(), "\n", layout.together()]
    if used:
        kinds = {f.kind for f in used}
        found = "asset.find_bodies if names is BODIES else asset.find_joints"
        parts.append(_DRAW if "mass" in kinds else _DRAW.replace(found, "asset.find_joints"))
        parts += [text for those, text in _WRITERS if kinds & set(those)]
    return "".join([*parts, "\n\n", _events(layout)])


def _events(layout: Layout) -> str:
    out = [
        "@configclass\nclass AxisightEvents:\n",
        '    """Events that draw the numbers above."""\n',
    ]
    if layout.fields.together:
        out.append(
            f'\n    together = EventTerm(func=draw_together, mode="{layout.mode}", '
            'params={"asset_cfg": SceneEntityCfg("robot")})\n'
        )
    for number, f in enumerate(layout.fields.alone, 1):
        out.append(_range(number, f))
    return "".join(out)


def _range(number: int, f: RandomizedField) -> str:
    low_high = f"({plain(f.low)}, {plain(f.high)})"
    if f.kind == "mass":
        where = f"body_names=[re.escape(BODIES[{f.joint!r}])]"
        function = "randomize_rigid_body_mass"
        values = (
            f'            "mass_distribution_params": {low_high},  # factor\n'
            '            "operation": "scale",\n'
            '            "recompute_inertia": False,\n'
        )
    else:
        where = f"joint_names=[re.escape(DRIVES[{f.joint!r}])]"
        function = "randomize_joint_parameters"
        values = (
            f'            "armature_distribution_params": {low_high},  # {f.unit}\n'
            '            "operation": "abs",\n'
        )
    return (
        f"\n    # {f.label}; varies between runs: {f.varies}\n"
        f"    {f.kind}_{number} = EventTerm(\n"
        f"        func=mdp.{function},\n"
        f'        mode="{mode_of([f])}",\n'
        f'        params={{\n            "asset_cfg": SceneEntityCfg("robot", {where}),\n{values}'
        '            "distribution": "uniform",\n        },\n    )\n'
    )
