"""The robots of this project as MuJoCo models (MJCF), built from the TOML text alone.

Hinges with springs and dampers stand for the joints. Each motor has a rotor, which a tendon of length ``r phi
- q`` couples to its joint: the same states and equations. The rotors' bodies stand on the base, so rotor
gyroscopics are absent here too.
"""

import tomllib
from collections.abc import Sequence


def vector(x: Sequence[float]) -> str:
    """Return numbers as an XML attribute."""
    return " ".join(repr(float(v)) for v in x)


def build(text: str, integrator: str, timestep: float) -> str:
    """Return the MJCF of a robot; positions are motor angles, then joint angles."""
    data = tomllib.loads(text)
    bodies, close, rotors, tendons, motors = "", "", "", "", ""
    for joint in data["joint"]:
        elastic = joint["kind"] == "elastic"
        spring = (
            f'stiffness="{joint["stiffness"]!r}" damping="{joint["damping"]!r}"' if elastic else ""
        )
        bodies += f'<body pos="{vector(joint["origin"])}">'
        bodies += f'<joint name="{joint["name"]}" axis="{vector(joint["axis"])}" {spring}/>'
        if "link" in joint:
            link = joint["link"]
            bodies += (
                f'<inertial pos="{vector(link["com"])}" mass="{link["mass"]!r}"'
                f' fullinertia="{vector(link["inertia"])}"/>'
            )
        else:
            # MuJoCo refuses a moving body without mass; this mass is too small to show.
            bodies += '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>'
        close += "</body>"
        if elastic:
            continue
        drive, name = joint["drive"], joint["name"]
        inertia = drive["motor_inertia"]
        rotors += (
            f'<body pos="0 0 -1"><joint name="{name}_rotor" axis="0 0 1"'
            f' damping="{drive["viscous_friction"]!r}"/>'
            f'<inertial pos="0 0 0" mass="1" diaginertia="{vector([inertia] * 3)}"/></body>'
        )
        tendons += (
            f'<fixed name="{name}_gear" stiffness="{joint["stiffness"]!r}"'
            f' damping="{joint["damping"]!r}" springlength="0">'
            f'<joint joint="{name}_rotor" coef="{drive["gear_ratio"]!r}"/>'
            f'<joint joint="{name}" coef="-1"/></fixed>'
        )
        motors += f'<motor joint="{name}_rotor"/>'
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
    <option timestep="{timestep!r}" integrator="{integrator}" gravity="{vector(data["gravity"])}">
    <flag contact="disable" constraint="disable"/></option>
    <worldbody>{rotors}{bodies}{close}</worldbody>
    <tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>"""
