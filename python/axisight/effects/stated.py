"""Which effects state what was identified, and where its numbers stand in them.

Fits have parameters of their own; robot files have effects. The one place that knows both.
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

    ``places`` maps the names of the fit to parameters of the effect; ``shape`` are values that the
    fit does not have.
    """

    name: str
    places: dict[str, str]
    shape: dict[str, float] = field(default_factory=dict)


MOST_RIPPLES = 3
"""Harmonics that a stated torque ripple holds."""


def of_axis_fit(
    *, stribeck: bool, ripple_orders: Sequence[float], smoothing_rad_s: float
) -> list[Stated]:
    """Return the effects that state the fit of one axis, by its thesis names (chapter 9)."""
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
    # A torque model needs the term from its motor, the effect gives it to the motor.
    "torque_offset": ("torque_offset", "offset_nm", -1.0),
}
"""Terms of a torque model that the robot has no parameter for: effect, its parameter and sign."""

_CORNER_SHARE = 0.003
_MOTOR_CORNER_RAD_S = 0.1


def friction_corner(top_speed: Array) -> Array:
    """Return over which speeds (n_axes,) the sign in dry friction is smoothed, from the largest seen.

    Narrow enough for hardly a sample to lie in it, wide enough to be integrated; at most the usual
    corner of motors, which is too wide for a slide or for speeds on the side of the joints.
    """
    return np.asarray(np.minimum(_CORNER_SHARE * np.asarray(top_speed), _MOTOR_CORNER_RAD_S))


RIGID_BODY_QUANTITIES = {
    "motor_inertia": "motor_inertia",
    "viscous_friction": "viscous_friction",
    "coulomb_friction": "dry_friction",
    "torque_offset": "torque_offset",
}
"""Terms of a torque model by what they take up of effects that the robot has."""

DRY_FRICTION = ("coulomb_friction", "coulomb_nm", "smoothing_rad_s")
"""What the dry friction of a joint in a model file is, its moment and its corner: of the motor."""

BEHIND_GEAR = "arm_share"
"""Which share of a friction the arm feels, behind an elastic gear: a parameter of friction laws without a memory."""

BRISTLES = ("presliding_friction", "presliding_rad", "relaxation_s")
"""What dry friction is that yields before it slips, over which way, and how fast it may slip in fits.

In torque that is predicted from motion it slips all the time, and is dry friction.
"""

VISCOUS_FRICTION = "viscous_friction"
"""What friction in proportion to speed is, beyond the simulator's."""

ROTOR = "rotor_inertia"
"""What the inertia of a motor is that a model file leaves out."""

MOTOR_INERTIA = "motor_inertia"
"""What a rotor is that is heavier or lighter than the simulator's."""

LINK_MASS, LINK_COM, LINK_INERTIA, LOAD = "link_mass", "link_com", "link_inertia", "payload"
"""What a link is whose mass [1], centre of mass [m] or inertia [1] is another, and a load on the last link.

Parameters: the relative change; the shift in the frame of the link; mass [kg] and place.
"""

LINK_GEOMETRY, JOINT_ZERO, BASE_TILT = (
    "link_geometry",
    ("joint_zero_offset", "offset_rad"),
    "base_tilt",
)
"""What an axis is that lies elsewhere in the link before it, an encoder with another zero, a tilted base.

Parameters: the shift in the frame of the link; its own; angles about x and y.
"""

JOINT_SPRING = ("cable_stiffness", "stiffness_nm_rad", "at_zero_nm")
"""What a spring of a joint is: its stiffness, and its torque where the joint is at zero."""

LAG = ("actuator_bandwidth", "time_constant_s")
"""What a drive that follows its command with a first-order lag is, and its parameter."""

TRANSPORT_DELAY = ("input_delay", "delay_s")
"""What a drive that acts late is, and its parameter."""

TORQUE_LIMIT = ("torque_saturation", "limit_nm")
"""What flat tops of a logged torque are, and its parameter."""

OTHER_GAINS = ("controller_gain", ("relative_proportional", "relative_integral"))
"""What a controller with other gains is, and its parameters: of the proportional, of the integral gain."""

GAIN_OF_POSITION = (OTHER_GAINS[0], "relative_position")
"""The same of the position loop of a cascade, and its parameter."""

SPEED_FILTER = ("velocity_filter", "time_constant_s")
"""What a filter on the controller's speed is, and its parameter."""

FEEDFORWARD = ("feedforward_missing", ("acceleration_nm_s2_rad", "speed_nm_s_rad"))
"""What torque fed forward is, and its parameters: for the rate of the reference, for the reference."""

CLOCK = ("clock_drift", "relative_rate")
"""What a clock of its own is, and its parameter."""

STEPS = ("position_quantization", "increment_rad")
"""What an encoder of few lines is, and its parameter."""

TORQUE_CONSTANT = ("torque_constant", "relative_error")
"""What a motor with another torque constant is, and its parameter."""

TORQUE_SENSOR = ("torque_sensor_gain", "relative_error")
"""What a torque that is reported too large or too small is, and its parameter."""

PLAY = ("backlash", "damped")
"""What a gear has whose middle is without stiffness, and its parameter for what is damped there."""

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
"""Effects on motors and joints whose torque hangs on what was before."""

DEMONSTRATION = Effect("coulomb_friction", 2, {"coulomb_nm": 0.6, "smoothing_rad_s": 0.08})
"""What the machine of the demonstration has and its simulator has not."""
