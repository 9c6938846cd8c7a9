"""Which effects state an identified quantity, and in which of their parameters.

Fits have parameters of their own, robot files have effects. Only this module knows both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.effects.effect import Effect

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stated:
    """An effect that states fitted parameters.

    ``places`` maps names of the fit to parameters of the effect. ``shape`` holds values that the fit does not
    have.
    """

    name: str
    places: dict[str, str]
    shape: dict[str, float] = field(default_factory=dict)


MOST_RIPPLES = 3
"""Most harmonics in a stated torque ripple."""


def of_axis_fit(
    *, stribeck: bool, ripple_orders: Sequence[float], smoothing_rad_s: float
) -> list[Stated]:
    """Return the effects that state the fit of one axis, with the parameter names of thesis chapter 9.

    ``ripple_orders`` [1/turn]: only the first `MOST_RIPPLES` are stated. ``smoothing_rad_s``: corner of dry
    friction.
    """
    friction = {"F_c": "coulomb_nm"}
    kind = "coulomb_friction"
    if stribeck:
        friction |= {"F_s": "excess_nm", "v_s": "stribeck_speed_rad_s"}
        kind = "stribeck_friction"
    orders = list(enumerate(ripple_orders[:MOST_RIPPLES], 1))
    ripple = {f"a_{n:g}": f"cosine_{i}_nm" for i, n in orders}
    ripple |= {f"b_{n:g}": f"sine_{i}_nm" for i, n in orders}
    return [
        Stated("nonlinear_stiffness", {"k3": "cubic_nm_rad3"}),
        Stated("backlash", {"b": "half_width_rad"}),
        Stated("torque_offset", {"u_0": "offset_nm"}),
        Stated(kind, friction, {"smoothing_rad_s": smoothing_rad_s}),
        Stated("torque_ripple", ripple, {f"order_{i}": n for i, n in orders}),
    ]


RIGID_BODY_TERMS = {
    "coulomb_friction": ("coulomb_friction", "coulomb_nm", 1.0),
    # A torque model subtracts the offset from the motor's torque, the effect adds it: hence the sign.
    "torque_offset": ("torque_offset", "offset_nm", -1.0),
}
"""Terms of a torque model that are no parameter of the robot: effect, parameter of the effect, sign."""

_CORNER_SHARE = 0.003
_MOTOR_CORNER_RAD_S = 0.1


def friction_corner(top_speed: Array) -> Array:
    """Return the speeds (n_axes,) that smooth the sign in dry friction, from the largest ``top_speed``.

    The result has the unit of ``top_speed`` (motor side [rad/s]). It is narrow, so that few samples lie
    inside, and wide enough to be integrated. Its upper limit is the usual corner of motors, which would be
    too wide for a slide or for joint-side speeds.
    """
    return np.asarray(np.minimum(_CORNER_SHARE * np.asarray(top_speed), _MOTOR_CORNER_RAD_S))


RIGID_BODY_QUANTITIES = {
    "motor_inertia": "motor_inertia",
    "viscous_friction": "viscous_friction",
    "coulomb_friction": "dry_friction",
    "torque_offset": "torque_offset",
}
"""Terms of a torque model, and the name under which effects state that the term absorbs them."""

DRY_FRICTION = ("coulomb_friction", "coulomb_nm", "smoothing_rad_s")
"""Dry friction of a joint in a model file: effect, its torque and its corner, both on the motor side."""

BEHIND_GEAR = "arm_share"
"""Parameter of friction laws without memory: the share that acts on the arm, behind an elastic gear."""

LEAD = "lead_s"
"""Parameter of dry friction: time by which it acts ahead of the speed, as in simulators with soft constraints."""

BRISTLES = ("presliding_friction", "presliding_rad", "relaxation_s")
"""Dry friction that yields before it slips: effect, displacement before slip, relaxation time in fits.

In torque predicted from motion this friction always slips, and equals dry friction.
"""

FALLING_FRICTION = (
    "stribeck_friction",
    "coulomb_nm",
    "excess_nm",
    "stribeck_speed_rad_s",
    "smoothing_rad_s",
)
"""Dry friction that falls from standstill: effect, its level at speed, the excess at rest, speed, corner."""

BRISTLE_SHAPE = ("coulomb_nm", "static_ratio", "stribeck_speed_rad_s", "bristle_time_s")
"""Parameters of friction with bristles beside those of `BRISTLES`."""

DRAG = ("quadratic_drag", "drag_nm_s2_rad2")
"""Friction proportional to the squared speed: effect and parameter."""

COGGING = "torque_ripple"
"""Torque that repeats with the motor angle; `EffectInfo.waves` has its parameters."""

BALANCE = ("gravity_compensation", "sine_nm", "cosine_nm")
"""Torque of a balance spring on the joint: effect, its sine and its cosine of the joint angle."""

LATE_READING = ("sensor_delay", "delay_s")
"""Encoder that is read late: effect and parameter."""

OFFSET = ("torque_offset", "offset_nm")
"""Constant torque of a motor: effect and parameter."""

VISCOUS_FRICTION = "viscous_friction"
"""Friction proportional to speed, beyond the simulator's own."""

ROTOR = "rotor_inertia"
"""Motor inertia that a model file leaves out."""

MOTOR_INERTIA = "motor_inertia"
"""Change of the simulator's motor inertia."""

LINK_MASS, LINK_COM, LINK_INERTIA, LOAD = "link_mass", "link_com", "link_inertia", "payload"
"""A change of a link's mass [1], centre of mass [m] or inertia [1], and a load on the last link.

Parameters of the load: mass [kg] and position. The centre of mass shifts in the frame of the link.
"""

OWN_INERTIA = ((LOAD, "mass_kg", "gyration_m2"),)
"""Bodies that an effect adds: effect, its mass, and the squared radius of gyration, which no fit frees."""

LINK_GEOMETRY, JOINT_ZERO, BASE_TILT = (
    "link_geometry",
    ("joint_zero_offset", "offset_rad"),
    "base_tilt",
)
"""An axis with another position in the link before it, an encoder with another zero, a tilted base.

Parameters: shift in the frame of the link, offset of the zero, angles about x and y.
"""

CONSTANT_TORQUE = "torque_offset"
"""Constant torque of a motor, beside what its controller commands."""

JOINT_SPRING = ("cable_stiffness", "stiffness_nm_rad", "at_zero_nm")
"""Spring on a joint: effect, its stiffness, its torque where the joint is at zero."""

LAG = ("actuator_bandwidth", "time_constant_s")
"""Drive that follows its command with a first-order lag: effect and parameter."""

TRANSPORT_DELAY = ("input_delay", "delay_s")
"""Drive that acts late: effect and parameter."""

TORQUE_LIMIT = ("torque_saturation", "limit_nm")
"""Limit of the torque, which gives logged torque flat tops: effect and parameter."""

OTHER_GAINS = ("controller_gain", ("relative_proportional", "relative_integral"))
"""Controller with other gains: effect, parameters of the proportional and of the integral gain."""

GAIN_OF_POSITION = (OTHER_GAINS[0], "relative_position")
"""Cascade with another gain of the position loop: effect and parameter."""

SPEED_FILTER = ("velocity_filter", "time_constant_s")
"""Filter on the controller's speed: effect and parameter."""

FEEDFORWARD = ("feedforward_missing", ("acceleration_nm_s2_rad", "speed_nm_s_rad"))
"""Torque feedforward: effect, parameters for the rate of the speed reference and for the reference itself."""

CLOCK = ("clock_drift", "relative_rate")
"""Clock that differs from the references': effect and parameter."""

STEPS = ("position_quantization", "increment_rad")
"""Encoder with few lines: effect and parameter."""

TORQUE_CONSTANT = ("torque_constant", "relative_error")
"""Motor with another torque constant: effect and parameter."""

TORQUE_SENSOR = ("torque_sensor_gain", "relative_error")
"""Torque that is reported too large or too small: effect and parameter."""

PLAY = ("backlash", "damped")
"""Gear without stiffness in its middle: effect, parameter for the damping there."""

HALF_PLAY = "half_width_rad"
"""Parameter of `PLAY`: half the width of the middle, joint side."""

WITH_MEMORY = frozenset(
    {
        "presliding_friction",
        "friction_warmup",
        "extra_mode",
        "input_delay",
        "actuator_bandwidth",
        "current_loop",
    }
)
"""Effects on motors and joints whose torque depends on the past."""

DEMONSTRATION = Effect("coulomb_friction", 2, {"coulomb_nm": 0.6, "smoothing_rad_s": 0.08})
"""The effect that the machine of the demonstration has and its simulator lacks."""


def on_every_machine(name: str) -> bool:
    """Return whether every axis of a machine has an effect, although a model file may leave it out."""
    return name in (VISCOUS_FRICTION, DRY_FRICTION[0], ROTOR)


def of_rigid_bodies(name: str) -> bool:
    """Return whether an effect changes the rigid bodies of an arm, or a constant torque of an axis.

    Least squares free these together with friction and rotors.
    """
    return name in (LINK_MASS, LINK_COM, LINK_INERTIA, CONSTANT_TORQUE)
