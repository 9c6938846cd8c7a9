"""Code for MuJoCo Playground: one function that randomises an MJX model for all environments."""

from __future__ import annotations

from axisight.posterior.randomization.layout import Layout, plain

_IMPORTS = """
import jax
import jax.numpy as jp

"""

_CODE = '''

def draw(key):
    """Return the values of one environment by (kind, joint)."""
    first, second, third = jax.random.split(key, 3)
    uniform = jax.random.uniform(first, (len(ALONE),))
    values = {name: a + u * (b - a) for (name, (a, b)), u in zip(ALONE.items(), uniform, strict=True)}
{together}    return values


def make_domain_randomize(mj_model):
    """Return ``randomization_fn`` for training on this ``mujoco.MjModel``."""

    def dof(name):
        return int(mj_model.jnt_dofadr[mj_model.joint(name).id])

    def domain_randomize(model, rng):
        """Draw every environment once; ``rng`` has one key for each."""

        @jax.vmap
        def randomized(key):
            values, fields = draw(key), {}

            def put(field, place, value):
                fields[field] = fields.get(field, getattr(model, field)).at[place].set(value)

            for (kind, joint), value in values.items():
                if kind in ON_DRIVE:
                    put(ON_DRIVE[kind], dof(DRIVES[joint]), value)
                elif kind == "gear_damping":
                    put("dof_damping", dof(GEARS[joint]), value)
                elif kind in ("spring", "gear_stiffness"):
                    put("jnt_stiffness", mj_model.joint(GEARS[joint]).id, value)
                elif kind in ON_BODY:
                    body = mj_model.body(BODIES[joint]).id
                    put(ON_BODY[kind], body, value * getattr(model, ON_BODY[kind])[body])
                elif kind == "force_limit":
                    limits = jp.stack([-value, value])
                    put("actuator_forcerange", mj_model.actuator(ACTUATORS[joint]).id, limits)
            for joint in dict.fromkeys(j for k, j in values if k in ("kp", "kd", "torque")):
                place = mj_model.actuator(ACTUATORS[joint]).id
                kp, kd, torque = (values.get((k, joint), 1.0) for k in ("kp", "kd", "torque"))
                gain, bias = model.actuator_gainprm[place], model.actuator_biasprm[place]
                put("actuator_gainprm", place, gain.at[0].multiply(kp * torque))
                factors = jp.stack([kp * torque, kd * torque])
                put("actuator_biasprm", place, bias.at[1:3].multiply(factors))
            return fields

        drawn = randomized(rng)
        in_axes = jax.tree_util.tree_map(lambda x: None, model)
        in_axes = in_axes.tree_replace({name: 0 for name in drawn})
        return model.tree_replace(drawn), in_axes

    return domain_randomize
'''

_TOGETHER = """    which = jax.random.categorical(second, jp.log(jp.array(WEIGHTS)))
    normal = jax.random.normal(third, (len(TOGETHER),))
    drawn = jp.array(MEANS)[which] + jp.array(ROOTS)[which] @ normal
    drawn = jp.clip(drawn, jp.array(LOW), jp.array(HIGH))
    values.update(zip(TOGETHER, drawn, strict=True))
"""

_TABLES = """
ON_DRIVE = {"armature": "dof_armature", "damping": "dof_damping", "frictionloss": "dof_frictionloss"}
ON_BODY = {"mass": "body_mass", "inertia": "body_inertia"}
"""


def playground(layout: Layout) -> str:
    """Return the code: ``make_domain_randomize`` makes the function that training takes as ``randomization_fn``."""
    ranges = "".join(
        f"    ({f.kind!r}, {f.joint!r}): ({plain(f.low)}, {plain(f.high)}),  # {f.unit}; varies: {f.varies}\n"
        for f in layout.fields.alone
    )
    together = layout.together()
    return "".join(
        [
            layout.head(),
            _IMPORTS,
            layout.names(),
            _TABLES,
            "# Independent numbers: uniform ranges. Training draws each environment once, and keeps the draw.\n",
            f"ALONE = {{\n{ranges}}}\n",
            together,
            _CODE.replace("{together}", _TOGETHER if together else ""),
        ]
    )
