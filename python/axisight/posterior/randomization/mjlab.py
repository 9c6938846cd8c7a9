"""Code for mjlab: one event for each independent number, and one that draws correlated numbers together."""

from __future__ import annotations

from axisight.posterior.randomization.fields import RandomizedField
from axisight.posterior.randomization.layout import (
    ON_ACTUATOR,
    ON_BODY,
    ON_DRIVE,
    Layout,
    mode_of,
    plain,
)

# Kind -> what the function of mjlab is called behind "joint_"; that of masses is body_mass.
_OF_JOINTS = {
    "armature": "armature",
    "damping": "damping",
    "frictionloss": "friction",
    "spring": "stiffness",
    "gear_stiffness": "stiffness",
    "gear_damping": "damping",
}

_MODEL_FIELDS = {
    "armature": ("dof_armature",),
    "damping": ("dof_damping",),
    "frictionloss": ("dof_frictionloss",),
    "spring": ("jnt_stiffness",),
    "gear_stiffness": ("jnt_stiffness",),
    "gear_damping": ("dof_damping",),
    "mass": ("body_mass",),
    "inertia": ("body_inertia",),
    "kp": ("actuator_gainprm", "actuator_biasprm"),
    "kd": ("actuator_gainprm", "actuator_biasprm"),
    "torque": ("actuator_gainprm", "actuator_biasprm"),
    "force_limit": ("actuator_forcerange", "jnt_actfrcrange"),
}

_IMPORTS = """
import re

{torch}{ranges}from mjlab.managers.event_manager import EventTermCfg{more}
from mjlab.managers.scene_entity_config import SceneEntityCfg

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

'''

_WRITER = '''
@requires_model_fields({fields}, recompute=RecomputeLevel.{level})
def draw_together(env, env_ids, asset_cfg=SceneEntityCfg("robot")):
    """Draw the correlated numbers of each environment together, and write them into its model."""
    asset, model, default = env.scene[asset_cfg.name], env.sim.model, env.sim.get_default_field
    every = torch.arange(env.num_envs, device=env.device)
    worlds = (every if env_ids is None else env_ids.to(env.device).long())[:, None]
    values = dict(zip(TOGETHER, _draw(len(worlds), env.device).T, strict=True))
'''

# Statements of the writer for the kinds that need them.
_JOINTS = """    for kind, field, names in {rows}:
        for joint in (j for k, j in values if k == kind):
            found, _ = asset.find_joints(re.escape(names[joint]))
            place = asset.indexing.joint_v_adr[found]
            getattr(model, field)[worlds, place] = values[kind, joint][:, None]
"""
_SPRINGS = """    for kind in ("spring", "gear_stiffness"):
        for joint in (j for k, j in values if k == kind):
            found, _ = asset.find_joints(re.escape(GEARS[joint]))
            model.jnt_stiffness[worlds, asset.indexing.joint_ids[found]] = values[kind, joint][:, None]
"""
_BODIES = """    for kind, field in (("mass", "body_mass"), ("inertia", "body_inertia")):
        for joint in (j for k, j in values if k == kind):
            found, _ = asset.find_bodies(re.escape(BODIES[joint]))
            place = asset.indexing.body_ids[found]
            nominal = default(field)[place]
            factor = values[kind, joint].reshape(-1, *[1] * nominal.ndim)
            getattr(model, field)[worlds, place] = nominal * factor
"""
_ACTUATOR = '''

def servo(asset, joint):
    """Return the actuator that drives a joint, and the place of the joint among those that it drives."""
    name = ACTUATORS[joint]
    for actuator in asset.actuators:
        if name in actuator.target_names:
            return actuator, actuator.target_names.index(name)
    raise ValueError(f"ACTUATORS: expected a joint with an actuator, got {name!r}")

'''
_SERVOS = """    one, ids = torch.ones(len(worlds), device=env.device), worlds[:, 0]
    for joint in dict.fromkeys(j for k, j in values if k in ("kp", "kd", "torque")):
        actuator, place = servo(asset, joint)
        kp, kd, torque = (values.get((k, joint), one) for k in ("kp", "kd", "torque"))
        outside = hasattr(actuator, "default_stiffness")
        if outside:  # mjlab computes the servo, and the model has a motor.
            actuator.stiffness[ids, place] = actuator.default_stiffness[ids, place] * kp
            actuator.damping[ids, place] = actuator.default_damping[ids, place] * kd
        # A joint with two actuators has the gain on the speed in the second one.
        for number, at in enumerate(actuator.global_ctrl_ids[place :: len(actuator.target_names)]):
            gain, bias = default("actuator_gainprm")[at], default("actuator_biasprm")[at]
            own = one if outside else kp if number == 0 else kd
            model.actuator_gainprm[ids, at, 0] = gain[0] * own * torque
            model.actuator_biasprm[ids, at, 1] = bias[1] * kp * torque
            model.actuator_biasprm[ids, at, 2] = bias[2] * kd * torque
"""
_LIMITS = """    for joint in (j for k, j in values if k == "force_limit"):
        actuator, place = servo(asset, joint)
        limit, ids = values["force_limit", joint], worlds[:, 0]
        if hasattr(actuator, "default_force_limit"):
            actuator.force_limit[ids, place] = limit
            continue
        # The limit of a joint with two actuators stands in the joint.
        double = len(actuator.global_ctrl_ids) > len(actuator.target_names)
        field = model.jnt_actfrcrange if double else model.actuator_forcerange
        joints = asset.indexing.joint_ids[actuator.target_ids]
        at = joints[place] if double else actuator.global_ctrl_ids[place]
        field[ids, at, 0] = -limit
        field[ids, at, 1] = limit
"""


def mjlab(layout: Layout) -> str:
    """Return the code: a dictionary ``EVENTS`` for the ``events`` of an environment."""
    used = [layout.fields.every[i] for i in layout.fields.together]
    imports = _IMPORTS.format(
        torch="import torch\n" if used else "",
        ranges="from mjlab.envs.mdp import dr\n" if layout.fields.alone else "",
        more=", RecomputeLevel, requires_model_fields" if used else "",
    )
    parts = [layout.head(), imports, layout.names(actuators_by_joint=True), "\n", layout.together()]
    if used:
        parts += [_DRAW, _writer(used)]
    return "".join([*parts, "\n\n", _events(layout)])


def _writer(used: list[RandomizedField]) -> str:
    kinds = dict.fromkeys(f.kind for f in used)
    fields = dict.fromkeys(name for kind in kinds for name in _MODEL_FIELDS[kind])
    level = "none"
    if "armature" in kinds:
        level = "set_const_0"
    if kinds.keys() & set(ON_BODY):
        level = "set_const"
    out = [_ACTUATOR] if kinds.keys() & set(ON_ACTUATOR) else []
    out.append(_WRITER.format(fields=", ".join(f'"{name}"' for name in fields), level=level))
    table = {"gear_damping": "GEARS"} | dict.fromkeys(ON_DRIVE, "DRIVES")
    rows = [
        f'("{kind}", "{_MODEL_FIELDS[kind][0]}", {table[kind]})' for kind in kinds if kind in table
    ]
    if rows:
        out.append(_JOINTS.replace("{rows}", f"({', '.join(rows)},)"))
    for those, text in (
        (("spring", "gear_stiffness"), _SPRINGS),
        (ON_BODY, _BODIES),
        (("kp", "kd", "torque"), _SERVOS),
        (("force_limit",), _LIMITS),
    ):
        if kinds.keys() & set(those):
            out.append(text)
    return "".join(out)


def _events(layout: Layout) -> str:
    out = ["EVENTS = {\n"]
    if layout.fields.together:
        out.append(
            f'    "axisight_together": EventTermCfg(mode="{layout.mode}", func=draw_together),\n'
        )
    groups: dict[tuple[str, str], list[RandomizedField]] = {}
    for f in layout.fields.alone:
        groups.setdefault((f.kind, mode_of([f])), []).append(f)
    for (kind, mode), fields in groups.items():
        operation = "scale" if kind in ON_BODY else "abs"
        function = "body_mass" if kind in ON_BODY else f"joint_{_OF_JOINTS[kind]}"
        out.append(
            f'    "axisight_{kind}_{mode}": EventTermCfg(\n'
            f'        mode="{mode}",\n'
            f"        func=dr.{function},\n"
            f'        params={{\n            "asset_cfg": SceneEntityCfg("robot"),\n            "ranges": {{\n'
        )
        table = "BODIES" if kind in ON_BODY else "DRIVES" if kind in ON_DRIVE else "GEARS"
        out += [
            f"                re.escape({table}[{f.joint!r}]): ({plain(f.low)}, {plain(f.high)}),  # {f.unit}\n"
            for f in fields
        ]
        out.append(
            f'            }},\n            "operation": "{operation}",\n        }},\n    ),\n'
        )
    out.append("}\n")
    return "".join(out)
