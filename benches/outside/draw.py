"""Which effects can be drawn on which arm and axis, and the plan of a draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from . import drives, friction, gears, loads, sensing, strangers
from .arms import Arm
from .withheld import Place, Withheld

# How often each arm is taken where an effect may be drawn on several of its engine.
WEIGHTS = {
    "elastic_handler": 0.35,
    "elastic_reacher": 0.2,
    "rigid_six": 0.2,
    "rigid_stacker": 0.25,
    "elastic_scara": 0.25,
    "elastic_loader": 0.35,
    "rigid_desk": 0.25,
    "rigid_offset": 0.15,
    "elastic_rocker": 0.25,
    "elastic_crane": 0.35,
    "rigid_hanger": 0.25,
    "rigid_forge": 0.15,
    "elastic_palletizer": 0.35,
    "elastic_mount": 0.25,
    "rigid_welder": 0.25,
    "rigid_assembler": 0.25,
}
AXES = {
    "elastic_handler": 3,
    "elastic_reacher": 2,
    "rigid_six": 6,
    "rigid_stacker": 4,
    "elastic_scara": 3,
    "elastic_loader": 3,
    "rigid_desk": 5,
    "rigid_offset": 6,
    "elastic_rocker": 2,
    "elastic_crane": 3,
    "rigid_hanger": 4,
    "rigid_forge": 6,
    "elastic_palletizer": 4,
    "elastic_mount": 2,
    "rigid_welder": 5,
    "rigid_assembler": 4,
}
ALL = {arm: range(n) for arm, n in AXES.items()}
WITH_GEARS = {arm: axes for arm, axes in ALL.items() if arm.startswith("elastic")}
WITHOUT_GEARS = {arm: axes for arm, axes in ALL.items() if arm.startswith("rigid")}
# Axes that carry no weight: what has no unique rest under load is drawn there.
WEIGHTLESS = {
    "elastic_handler": (0,),
    "rigid_six": (0,),
    "rigid_stacker": (0, 3),
    "elastic_scara": (0, 1, 2),
    "elastic_loader": (0,),
    "rigid_desk": (0,),
    "rigid_offset": (0,),
    "elastic_crane": (0,),
    "rigid_hanger": (0,),
    "rigid_forge": (0,),
    "elastic_palletizer": (0,),
    "elastic_mount": (0,),
    "rigid_welder": (0,),
    "rigid_assembler": (0, 1, 2),
}
WEIGHTLESS_GEARS = {arm: axes for arm, axes in WEIGHTLESS.items() if arm in WITH_GEARS}
WITH_WEIGHT = {
    "elastic_handler": (1, 2),
    "elastic_reacher": (0, 1),
    "rigid_six": (1, 2, 4),
    "rigid_stacker": (1, 2),
    "elastic_loader": (1, 2),
    "rigid_desk": (1, 2, 3),
    "rigid_offset": (1, 2, 3),
    "elastic_rocker": (0, 1),
    "elastic_crane": (1, 2),
    "rigid_hanger": (1, 2),
    "rigid_forge": (1, 2, 4),
    "elastic_palletizer": (1, 2),
    "elastic_mount": (1,),
    "rigid_welder": (1, 2, 4),
    "rigid_assembler": (3,),
}
# Links whose mass no other axis and no load on the last link replaces. On the first axis of a
# horizontal arm a mass is one with an inertia.
INNER = {
    "elastic_handler": (1,),
    "elastic_reacher": (0,),
    "rigid_six": (1, 2, 3),
    "rigid_stacker": (1, 2),
    "elastic_scara": (1,),
    "elastic_loader": (1,),
    "rigid_desk": (1, 2),
    "rigid_offset": (1, 2),
    "elastic_rocker": (0,),
    "elastic_crane": (1,),
    "rigid_hanger": (1, 2),
    "rigid_forge": (1, 2),
    "elastic_palletizer": (1,),
    "rigid_welder": (1, 2),
    "rigid_assembler": (1,),
}
# An inertia about the first axis of a rigid arm is one with its rotor.
TURNING = {
    "elastic_handler": (1, 2),
    "elastic_reacher": (0, 1),
    "rigid_six": (1, 2, 3, 5),
    "rigid_stacker": (1, 2),
    "elastic_scara": (1, 2),
    "elastic_loader": (1, 2),
    "rigid_desk": (2, 3),
    "rigid_offset": (2, 3),
    "elastic_rocker": (0, 1),
    "elastic_crane": (1, 2),
    "rigid_hanger": (1, 2),
    "rigid_forge": (1, 2, 3),
    "elastic_palletizer": (1, 2),
    "elastic_mount": (1,),
    "rigid_welder": (1, 2),
    "rigid_assembler": (1,),
}


@dataclass(frozen=True)
class Kind:
    """A function that draws an effect, and the axes where it may."""

    draw: Callable[[Place], Withheld]
    axes: dict[str, tuple[int, ...] | range]


def _kinds(axes, *functions) -> dict[str, Kind]:
    return {function.__name__: Kind(function, axes) for function in functions}


SINGLE: dict[str, Kind] = {
    **_kinds(
        ALL,
        friction.viscous_friction, friction.coulomb_friction, friction.stribeck_friction,
        friction.asymmetric_friction, friction.quadratic_drag, friction.friction_warmup,
        friction.position_dependent_friction, friction.presliding_friction,
        drives.torque_constant, drives.torque_offset, drives.torque_saturation,
        drives.actuator_bandwidth, drives.current_loop, drives.input_delay,
        drives.power_supply_sag, drives.torque_ripple,
        sensing.resolver_ripple, sensing.encoder_eccentricity, sensing.position_quantization,
        sensing.sensor_delay, sensing.torque_sensor_gain, sensing.torque_sensor_offset,
        sensing.controller_gain, sensing.velocity_filter, sensing.feedforward_missing,
        loads.motor_inertia, loads.cable_stiffness,
    ),
    **_kinds(
        WITH_GEARS,
        friction.load_dependent_friction, gears.joint_stiffness, gears.joint_damping,
        gears.backlash, gears.nonlinear_stiffness, gears.transmission_error, loads.extra_mode,
    ),
    **_kinds(
        WEIGHTLESS_GEARS,
        gears.piecewise_stiffness, gears.lost_motion, gears.gear_hysteresis,
    ),
    **_kinds(
        dict.fromkeys(
            ("elastic_handler", "elastic_loader", "elastic_crane", "elastic_palletizer"), (0,)
        ),
        loads.base_compliance,
    ),
    **_kinds(WEIGHTLESS, drives.torque_deadband),
    **_kinds(WITH_WEIGHT, loads.joint_zero_offset, loads.gravity_compensation),
    **_kinds(INNER, loads.link_mass, loads.link_com),
    **_kinds(TURNING, loads.link_inertia),
    **_kinds(WITHOUT_GEARS, loads.rotor_inertia),
    **_kinds(
        {"rigid_six": (4,), "rigid_desk": (3,), "rigid_offset": (4,), "rigid_forge": (4,),
         "rigid_welder": (3,)},
        friction.axis_coupling,
    ),
    **_kinds(dict.fromkeys(AXES, (0,)), loads.payload, loads.base_tilt, sensing.clock_drift),
}  # fmt: skip

STRANGERS: dict[str, Kind] = {
    **_kinds(ALL, strangers.tone, strangers.late_brake, strangers.tight_spot, strangers.leaning,
             strangers.wall, strangers.dropouts),
    **_kinds(dict.fromkeys(("elastic_handler", "rigid_six", "rigid_stacker", "elastic_loader",
                            "rigid_desk", "rigid_offset", "elastic_crane", "rigid_hanger",
                            "rigid_forge", "elastic_palletizer", "rigid_welder",
                            "rigid_assembler"), (1,)), strangers.strap),
    **_kinds({arm: ALL[arm] for arm in ("elastic_handler", "elastic_scara", "elastic_loader",
                                        "elastic_crane", "elastic_palletizer")},
             strangers.cubic_damper),
}  # fmt: skip

# Two of these on two axes make a pair.
PAIRED = (
    "viscous_friction", "coulomb_friction", "stribeck_friction", "torque_constant", "input_delay",
    "torque_ripple", "resolver_ripple", "backlash", "joint_stiffness", "nonlinear_stiffness",
    "motor_inertia", "cable_stiffness", "actuator_bandwidth",
)  # fmt: skip

NOTHING, PAIRS, OUTSIDE = 1 / 8, 1 / 11, 1 / 11


def plan(seed: int, count: int) -> list[tuple[str, tuple[str, ...]]]:
    """Return class and names of every case of a draw, in order.

    Single effects and strangers are taken in turn from their shuffled lists, so that a draw of some
    fifty single effects has nearly all of them once.
    """
    rng = np.random.default_rng([seed, count])

    def taken(names, n: int) -> list[str]:
        names = list(names)
        turns = -(-n // len(names)) if n else 0
        return [str(x) for _ in range(turns) for x in rng.permutation(names)][:n]

    nothing, pairs, outside = (round(count * share) for share in (NOTHING, PAIRS, OUTSIDE))
    cases: list[tuple[str, tuple[str, ...]]] = [("nothing", ())] * nothing
    for _ in range(pairs):
        cases.append(("pair", tuple(str(x) for x in rng.choice(PAIRED, 2, replace=False))))
    cases += [("outside", (name,)) for name in taken(STRANGERS, outside)]
    cases += [("single", (name,)) for name in taken(SINGLE, count - nothing - pairs - outside)]
    return [cases[i] for i in rng.permutation(count)]


def kind(name: str) -> Kind:
    """Return a kind by its name."""
    return SINGLE.get(name) or STRANGERS[name]


def arm_and_axes(
    rng: np.random.Generator, names: tuple[str, ...], arms: tuple[str, ...]
) -> tuple[str, list[int]]:
    """Return the name of an arm that can bear all these effects, and an axis for each, all different.

    ``arms`` are those to choose from.
    """
    able = [arm for arm in arms if all(arm in kind(name).axes for name in names)]
    weights = np.array([WEIGHTS[arm] for arm in able])
    arm = str(rng.choice(able, p=weights / weights.sum()))
    axes: list[int] = []
    for name in names:
        free = [axis for axis in kind(name).axes[arm] if axis not in axes]
        axes.append(int(rng.choice(free)))
    return arm, axes


def scattered(rng: np.random.Generator, arm: Arm) -> Arm:
    """Return a machine of the type: 1 % in masses, stiffness and rotors, 2 % in friction, 5 % in damping."""

    def times(value, spread: float):
        return None if value is None else value * float(1 + spread * rng.standard_normal())

    joints = []
    for joint in arm.joints:
        link = joint.link
        if link is not None:
            factor = float(1 + 0.01 * rng.standard_normal())
            link = replace(
                link, mass_kg=link.mass_kg * factor, inertia_kg_m2=link.inertia_kg_m2 * factor
            )
        joints.append(
            replace(
                joint,
                link=link,
                stiffness=times(joint.stiffness, 0.01),
                damping=times(joint.damping, 0.05),
                motor_inertia=times(joint.motor_inertia, 0.01),
                viscous=times(joint.viscous, 0.02),
            )
        )
    return replace(arm, joints=tuple(joints))
