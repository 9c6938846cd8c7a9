"""An arm as a MuJoCo model, with what MuJoCo itself has to make a machine differ from its simulator."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from axisight.robot import Robot
from axisight.robot.description import Joint

STEPS_PER_SAMPLE = 2
"""Of the engine's integrator."""


@dataclass(frozen=True)
class Native:
    """What MuJoCo changes by itself on one axis, or at the tip.

    ``half_width_rad``: the gear's tendon is slack within; ``friction_nm``: dry friction of the motor by
    the constraint solver; ``armature``: share of motor inertia added; ``spring``, ``damper``: shares added
    to gear stiffness and damping; ``viscous``: share added to viscous friction of the motor;
    ``gear``: share added to the torque of the actuator; ``lag_s``: its time constant; ``kp``, ``ki``: shares
    added to the gains of the controller, ``filter_s`` the time constant of a filter on its speed;
    ``zero_rad``: angle of the joint where it counts zero; ``for_rate``, ``for_speed``: torque fed forward
    for the rate of the reference [Nm s^2/rad] and for the reference [Nm s/rad].
    """

    half_width_rad: float = 0.0
    friction_nm: float = 0.0
    armature: float = 0.0
    spring: float = 0.0
    damper: float = 0.0
    viscous: float = 0.0
    gear: float = 0.0
    lag_s: float = 0.0
    kp: float = 0.0
    ki: float = 0.0
    filter_s: float = 0.0
    zero_rad: float = 0.0
    for_rate: float = 0.0
    for_speed: float = 0.0


NOTHING = Native()


@dataclass(frozen=True)
class Ends:
    """What MuJoCo changes at both ends of the arm.

    ``tip_kg`` at ``tip_m`` in the frame of the last link; ``rocks_rad_nm``: compliance of the base about
    x and y, none where it is zero, ``rocks_s`` their damping over stiffness.
    """

    tip_kg: float = 0.0
    tip_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rocks_rad_nm: tuple[float, float] = (0.0, 0.0)
    rocks_s: float = 0.0

    @property
    def springs(self) -> list[tuple[str, float]]:
        """Axis and stiffness of each spring of the base, ground to arm."""
        named = zip(("1 0 0", "0 1 0"), self.rocks_rad_nm, strict=True)
        return [(axis, 1 / c) for axis, c in named if c]


PLAIN = Ends()


# MuJoCo wants mass in every moving body; this much changes nothing visible.
_NEARLY_MASSLESS = '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>'


@dataclass
class _Parts:
    """Text of a model, part by part."""

    bodies: str = ""
    close: str = ""
    rotors: str = ""
    tendons: str = ""
    actuators: str = ""
    axes: list[str] = field(default_factory=list)


def mjcf(robot: Robot, native: Mapping[int, Native], ends: Ends, step_s: float) -> str:
    """Return the model (MJCF) of a robot: rotors on tendons that pull at their joints.

    ``native``: changes by axis, from 0. Positions are motor angles, then those of the base's springs,
    then joint angles.
    """
    parts = _Parts()
    for axis, stiffness in ends.springs:
        parts.bodies += (
            f'<body><joint axis="{axis}" stiffness="{stiffness!r}" damping="{stiffness * ends.rocks_s!r}"/>'
            f"{_NEARLY_MASSLESS}"
        )
        parts.close += "</body>"
    for joint in robot.joints:
        _add_joint(parts, joint, native)
    if ends.tip_kg:
        parts.bodies += (
            f'<body pos="{_vector(ends.tip_m)}">'
            f'<inertial pos="0 0 0" mass="{ends.tip_kg!r}" diaginertia="1e-6 1e-6 1e-6"/></body>'
        )
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
    <option timestep="{step_s!r}" integrator="RK4" gravity="{_vector(robot.gravity_m_s2)}">
    <flag contact="disable"/></option>
    <worldbody>{parts.rotors}{parts.bodies}{parts.close}</worldbody>
    <tendon>{parts.tendons}</tendon><actuator>{parts.actuators}</actuator></mujoco>"""


def _add_joint(parts: _Parts, joint: Joint, native: Mapping[int, Native]) -> None:
    spring = ""
    if joint.drive is None and joint.spring is not None:
        spring = f'stiffness="{joint.spring.stiffness!r}" damping="{joint.spring.damping!r}"'
    parts.bodies += f'<body pos="{_vector(joint.origin_m)}">'
    change = native.get(len(parts.axes), NOTHING) if joint.drive is not None else NOTHING
    # A position counts from where the bodies stand as they are written.
    zero = f'ref="{-change.zero_rad!r}"' if change.zero_rad else ""
    parts.bodies += f'<joint name="{joint.name}" axis="{_vector(joint.axis)}" {spring} {zero}/>'
    if joint.link is None:
        parts.bodies += _NEARLY_MASSLESS
    else:
        parts.bodies += (
            f'<inertial pos="{_vector(joint.link.com_m)}" mass="{joint.link.mass_kg!r}"'
            f' fullinertia="{_vector(joint.link.inertia_kg_m2)}"/>'
        )
    parts.close += "</body>"
    if joint.drive is not None:
        _add_drive(parts, joint, change)


def _add_drive(parts: _Parts, joint: Joint, change: Native) -> None:
    drive, spring, name = joint.drive, joint.spring, joint.name
    if drive is None or spring is None:
        raise ValueError(f"{name}: expected an elastic gear")
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
        f'<joint joint="{name}_rotor" coef="{drive.gear_ratio!r}"/>'
        f'<joint joint="{name}" coef="-1"/></fixed>'
    )
    lag = f' dyntype="filterexact" dynprm="{change.lag_s!r}"' if change.lag_s else ""
    parts.actuators += f'<general joint="{name}_rotor" gear="{1 + change.gear!r}"{lag}/>'


def _vector(x: Iterable[float]) -> str:
    return " ".join(repr(float(v)) for v in x)
