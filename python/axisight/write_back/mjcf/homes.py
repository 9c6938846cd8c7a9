"""Table of the effects that an MJCF can state: where, since which version of MuJoCo, and with which law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from axisight.display.summary import summarized
from axisight.effects.stated import (
    BALANCE,
    BASE_TILT,
    BRISTLES,
    COGGING,
    DRAG,
    DRY_FRICTION,
    FALLING_FRICTION,
    JOINT_SPRING,
    JOINT_ZERO,
    LAG,
    LATE_READING,
    LINK_COM,
    LINK_GEOMETRY,
    LINK_INERTIA,
    LINK_MASS,
    LOAD,
    MOTOR_INERTIA,
    OFFSET,
    OTHER_GAINS,
    ROTOR,
    TORQUE_CONSTANT,
    TORQUE_LIMIT,
    TRANSPORT_DELAY,
    VISCOUS_FRICTION,
)
from axisight.write_back.joints import POLYNOMIALS_SINCE
from axisight.write_back.mjcf.passive import SINCE as PASSIVE_SINCE
from axisight.write_back.mjcf.servos import DELAYS_SINCE
from axisight.write_back.mjcf.versions import OLDEST


@summarized
@dataclass(frozen=True)
class Home:
    """Place of an effect in an MJCF.

    - ``where``: element and attributes, as Markdown.
    - ``since``: first version of MuJoCo that reads them, at least `OLDEST`.
    - ``differs``: how MuJoCo's law differs from that of the effect; empty if both are equal.
    """

    where: str
    since: tuple[int, int] = OLDEST
    differs: str = ""


_SOFT = "a soft constraint, which has no corner and acts ahead of the speed"
_STEPS = "whole steps are exact; within a step, MuJoCo interpolates linearly"
_BODY = Home("`<inertial>` of the body")
_ARMATURE = Home("`armature` of the joint")
_PASSIVE = '`<dcmotor input="none">`'

_HOMES: Mapping[str, Home] = MappingProxyType(
    {
        DRY_FRICTION[0]: Home("`frictionloss` of the joint", differs=_SOFT),
        VISCOUS_FRICTION: Home("`damping` of the joint"),
        DRAG[0]: Home("second number of `damping` of the joint", POLYNOMIALS_SINCE),
        ROTOR: _ARMATURE,
        MOTOR_INERTIA: _ARMATURE,
        JOINT_SPRING[0]: Home("`stiffness` and `springref` of the joint"),
        BALANCE[0]: Home(f"`cogging` of a {_PASSIVE}, once a turn of the joint", PASSIVE_SINCE),
        COGGING: Home(
            f"`cogging` of a {_PASSIVE} for each harmonic",
            PASSIVE_SINCE,
            "the part in proportion to the command is refused",
        ),
        BRISTLES[0]: Home(
            f"`lugre` of a {_PASSIVE}",
            PASSIVE_SINCE,
            "equal, if the time step can follow the bristles; else these are softer and damped. Without the "
            "relaxation time, which only fits need",
        ),
        FALLING_FRICTION[0]: Home(
            f"`lugre` of a {_PASSIVE}, with stiff bristles",
            PASSIVE_SINCE,
            "equal in slip; below the corner the bristles hold where the effect creeps",
        ),
        TORQUE_CONSTANT[0]: Home("`gainprm` of the motor; gains of a servo"),
        OFFSET[0]: Home("`biasprm` of the motor or servo"),
        TORQUE_LIMIT[0]: Home("`ctrlrange` of a motor, `forcerange` of a servo"),
        OTHER_GAINS[0]: Home(
            "`kp` and `kv` of `<position>`, `<intvelocity>` and `<pid>`, `controller` of `<dcmotor>`"
        ),
        LAG[0]: Home(
            '`dyntype="filterexact"` and `dynprm` of the motor, `inductance` of a `<dcmotor>`'
        ),
        TRANSPORT_DELAY[0]: Home("`delay` and `nsample` of the actuator", DELAYS_SINCE, _STEPS),
        LATE_READING[0]: Home(
            "`delay` and `nsample` of `<jointpos>` and `<jointvel>`", DELAYS_SINCE, _STEPS
        ),
        LINK_MASS: _BODY,
        LINK_COM: _BODY,
        LINK_INERTIA: _BODY,
        LOAD: Home("`<inertial>` of the last body"),
        LINK_GEOMETRY: Home("`pos` of the next body"),
        JOINT_ZERO[0]: Home("`ref` of the joint"),
        BASE_TILT: Home("`gravity`"),
    }
)


def mujoco_homes() -> Mapping[str, Home]:
    """Return the homes in an MJCF by effect; effects without one are not in it."""
    return _HOMES
