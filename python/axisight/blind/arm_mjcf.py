"""An arm as a MuJoCo model, with those changes of a machine that MuJoCo simulates itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from axisight.blind.machine import NOTHING, Machine, Native
from axisight.robot.description import Joint

STEPS_PER_SAMPLE = 2
"""Integrator steps per sample."""


# MuJoCo refuses a moving body without mass; this mass is too small to show.
_NEARLY_MASSLESS = '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>'


@dataclass
class _Parts:
    """XML of a model, part by part."""

    bodies: str = ""
    close: str = ""
    rotors: str = ""
    tendons: str = ""
    actuators: str = ""
    axes: list[str] = field(default_factory=list)


def mjcf(machine: Machine, step_s: float) -> str:
    """Return the MuJoCo model (MJCF) of a machine: tendons join rotors and joints.

    Order of the positions: motor angles, springs of the base, joint angles. ``step_s`` is the step [s].
    """
    robot, ends = machine.robot, machine.ends
    parts = _Parts()
    for axis, stiffness in ends.springs:
        parts.bodies += (
            f'<body><joint axis="{_vector(axis)}" stiffness="{stiffness!r}" damping="{stiffness * ends.rocks_s!r}"/>'
            f"{_NEARLY_MASSLESS}"
        )
        parts.close += "</body>"
    for joint, origin in zip(robot.joints, machine.origins(), strict=True):
        _add_joint(parts, joint, origin, machine)
    if ends.tip_kg:
        parts.bodies += (
            f'<body pos="{_vector(ends.tip_m)}">'
            f'<inertial pos="0 0 0" mass="{ends.tip_kg!r}" diaginertia="1e-6 1e-6 1e-6"/></body>'
        )
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
    <option timestep="{step_s!r}" integrator="RK4" gravity="{_vector(machine.gravity_m_s2())}">
    <flag contact="disable"/></option>
    <worldbody>{parts.rotors}{parts.bodies}{parts.close}</worldbody>
    <tendon>{parts.tendons}</tendon><actuator>{parts.actuators}</actuator></mujoco>"""


def _add_joint(parts: _Parts, joint: Joint, origin: tuple[float, ...], machine: Machine) -> None:
    spring = ""
    if joint.drive is None and joint.spring is not None:
        spring = f'stiffness="{joint.spring.stiffness!r}" damping="{joint.spring.damping!r}"'
    parts.bodies += f'<body pos="{_vector(origin)}">'
    change = machine.native.get(len(parts.axes), NOTHING) if joint.drive is not None else NOTHING
    # MuJoCo counts a joint's position from the pose of the written bodies; ``ref`` shifts that zero.
    kind = "slide" if joint.prismatic else "hinge"
    zero = f'ref="{-change.zero_rad!r}"' if change.zero_rad else ""
    parts.bodies += (
        f'<joint name="{joint.name}" type="{kind}" axis="{_vector(joint.axis)}" {spring} {zero}/>'
    )
    if joint.link is None:
        parts.bodies += _NEARLY_MASSLESS
    else:
        parts.bodies += (
            f'<inertial pos="{_vector(joint.link.com_m)}" mass="{joint.link.mass_kg!r}"'
            f' fullinertia="{_vector(joint.link.inertia_kg_m2)}"/>'
        )
    parts.close += "</body>"
    if joint.drive is not None:
        _add_drive(parts, joint, change, machine.along()[len(parts.axes)].tolist())


def _add_drive(parts: _Parts, joint: Joint, change: Native, along: Sequence[float]) -> None:
    drive, spring, name = joint.drive, joint.spring, joint.name
    if drive is None or spring is None:
        raise ValueError(f"{name}: expected an elastic gear")
    # Drives of earlier axes whose rotation this gear feels too.
    others = [(other, by) for other, by in zip(parts.axes, along, strict=False) if by]
    turned = "".join(f'<joint joint="{other}_rotor" coef="{by!r}"/>' for other, by in others)
    parts.axes.append(name)
    inertia = drive.motor_inertia
    parts.rotors += (
        f'<body pos="0 0 -1"><joint name="{name}_rotor" axis="0 0 1"'
        f' damping="{drive.viscous_friction * (1 + change.viscous)!r}"'
        f' armature="{inertia * change.armature!r}" frictionloss="{change.friction_nm!r}"/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{_vector([inertia] * 3)}"/></body>'
    )
    width = change.half_width_rad
    parts.tendons += (
        f'<fixed name="{name}_gear" stiffness="{spring.stiffness * (1 + change.spring)!r}"'
        f' damping="{spring.damping * (1 + change.damper)!r}"'
        f' springlength="{-width!r} {width!r}">'
        f'<joint joint="{name}_rotor" coef="{drive.gear_ratio!r}"/>{turned}'
        f'<joint joint="{name}" coef="-1"/></fixed>'
    )
    lag = f' dyntype="filterexact" dynprm="{change.lag_s!r}"' if change.lag_s else ""
    parts.actuators += f'<general joint="{name}_rotor" gear="{1 + change.gear!r}"{lag}/>'


def _vector(x: Iterable[float]) -> str:
    return " ".join(repr(float(v)) for v in x)
