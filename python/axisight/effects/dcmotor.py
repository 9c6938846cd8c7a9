"""Effects that MuJoCo's ``dcmotor`` states as cogging or as LuGre friction, in both directions.

A ``dcmotor`` without inputs is passive: it adds torque to a joint, and no command. Angles and torques of its
cogging and its bristles are those before its gear.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from axisight.effects.effect import Effect
from axisight.effects.stated import (
    BALANCE,
    BRISTLE_SHAPE,
    BRISTLES,
    COGGING,
    FALLING_FRICTION,
)
from axisight.effects.table import effect_info

# Time [s] in which the bristles of a friction without bristles deflect at the speed of its corner.
_DEFLECTED_S = 0.01
# MuJoCo integrates bristles by explicit Euler. Their vibration with frequency w and damping ratio d stays bounded
# for w h < 2 d, with step h: so their damping takes at least this many steps, and w h is at most this.
_DAMPED_STEPS = 2.0
_FASTEST = 0.5
# Relative difference up to which an order is one a turn of the joint.
_ALIKE = 1e-9


@dataclass(frozen=True)
class Cogging:
    """Torque ``amplitude_nm sin(order x + phase_rad)`` [Nm] at the angle ``x``, both before the gear.

    ``gear``: angle before the gear per angle of the joint. ``order`` [1/rad of ``x``, that is 1/turn].
    """

    gear: float
    amplitude_nm: float
    order: float
    phase_rad: float


@dataclass(frozen=True)
class Bristles:
    """LuGre friction before the gear: ``-(s0 z + s1 z')`` with ``z' = w - s0 |w| z / g(w)``.

    ``g = coulomb_nm + (static_nm - coulomb_nm) exp(-(w / stribeck_speed_rad_s)^2)`` [Nm]. ``gear``: angle
    before the gear per angle of the joint. ``stiffness_nm_rad`` s0 and ``damping_nm_s_rad`` s1 are those of the
    bristles. Canudas de Wit et al. (1995), equations 1 to 3.
    """

    gear: float
    stiffness_nm_rad: float
    damping_nm_s_rad: float
    coulomb_nm: float
    static_nm: float
    stribeck_speed_rad_s: float


Device = Cogging | Bristles

DEVICE_EFFECTS = frozenset((COGGING, BALANCE[0], BRISTLES[0], FALLING_FRICTION[0]))
"""Effects that `devices_of` takes."""


def devices_of(
    effect: Effect, gear_ratio: float, *, step_s: float, inertia_kg_m2: float
) -> list[Device] | str:
    """Return the cogging or bristles of an effect on one axis, or why a ``dcmotor`` has none.

    ``gear_ratio``: joint angle per motor angle. ``step_s``: time step of the simulator [s]; ``inertia_kg_m2``:
    what the motor accelerates, motor side. Both limit stiffness and damping of bristles to what MuJoCo can
    integrate. Bristles have no relaxation time, which only fits need. A friction without bristles gets stiff
    ones: in slip its torque is the same, below the corner the bristles hold where the law creeps.
    """
    info = effect_info(effect.name)
    value = dict(zip((p.name for p in info.parameters), effect.values(), strict=True))
    gear = 1.0 / gear_ratio
    if effect.name == BALANCE[0]:
        return [_wave(1.0, 1.0, value[BALANCE[2]], value[BALANCE[1]])]
    if effect.name == COGGING:
        terms = info.terms().values()
        constant = {name for names in terms for name in names}
        sizes = [p.name for p in info.parameters if p.role == "amplitude"]
        if any(value[name] for name in sizes if name not in constant):
            return "a part of it is proportional to the command, which no cogging torque is"
        waves = [(value[order], value[a], value[b]) for order, a, b in terms]
        return [_wave(gear, order, a, b) for order, a, b in waves if a or b]
    if effect.name == BRISTLES[0]:
        coulomb, ratio, speed, time_s = (value[name] for name in BRISTLE_SHAPE)
        static, deflected_rad = ratio * coulomb, value[BRISTLES[1]]
    else:
        coulomb, excess, speed, corner = (value[name] for name in FALLING_FRICTION[1:])
        static, deflected_rad, time_s = coulomb + excess, corner * _DEFLECTED_S, 0.0
    stiffness = min(coulomb / deflected_rad, inertia_kg_m2 * (_FASTEST / step_s) ** 2)
    damping = stiffness * max(time_s, _DAMPED_STEPS * step_s)
    return [Bristles(gear, stiffness, damping, coulomb, static, speed)]


def effects_of(
    devices: Sequence[Device], axis: int, gear_ratio: float
) -> tuple[list[Effect], list[str]]:
    """Return the effects on an axis (from 1) that devices are, and what no effect can state.

    ``gear_ratio``: joint angle per motor angle, which may be another one than that of the devices. Cogging once
    a turn of the joint is a balance spring; every other cogging is a harmonic of the motor angle.
    """
    springs, waves = [0.0, 0.0], []
    bristles = [device for device in devices if isinstance(device, Bristles)]
    for device in devices:
        if isinstance(device, Cogging):
            turns, nm = device.gear * device.order, device.gear * device.amplitude_nm
            parts = nm * math.sin(device.phase_rad), nm * math.cos(device.phase_rad)
            if abs(abs(turns) - 1.0) < _ALIKE:
                springs[0] += math.copysign(parts[1], parts[1] * turns)
                springs[1] += parts[0]
            else:
                # The sine of a negative order is the negative sine.
                sign = math.copysign(1.0, turns * gear_ratio)
                order = abs(turns * gear_ratio)
                waves.append((order, gear_ratio * parts[0], sign * gear_ratio * parts[1]))
    out, left = [], []
    if any(springs):
        out.append(Effect(BALANCE[0], axis, dict(zip(BALANCE[1:], springs, strict=True))))
    names = list(effect_info(COGGING).terms().values())
    if waves:
        pairs = zip(names, waves, strict=False)
        out.append(
            Effect(COGGING, axis, {n: x for k, w in pairs for n, x in zip(k, w, strict=True)})
        )
    left += [f"cogging of order {order:g}" for order, _, _ in waves[len(names) :]]
    out += [_slipping(device, axis, gear_ratio) for device in bristles[:1]]
    left += ["a second LuGre friction"] * (len(bristles) > 1)
    return out, left


def _slipping(device: Bristles, axis: int, gear_ratio: float) -> Effect:
    """Return the effect that a LuGre friction is, on the motor."""
    # Angles before the gear of the device per motor angle.
    by = abs(device.gear * gear_ratio)
    values = (
        by * device.coulomb_nm,
        device.static_nm / device.coulomb_nm,
        device.stribeck_speed_rad_s / by,
        device.damping_nm_s_rad / device.stiffness_nm_rad,
    )
    found = dict(zip(BRISTLE_SHAPE, values, strict=True))
    return Effect(
        BRISTLES[0], axis, found | {BRISTLES[1]: device.coulomb_nm / device.stiffness_nm_rad / by}
    )


def _wave(gear: float, order: float, cosine_nm: float, sine_nm: float) -> Cogging:
    """Return the cogging ``cosine_nm cos(order x) + sine_nm sin(order x)``."""
    return Cogging(gear, math.hypot(cosine_nm, sine_nm), order, math.atan2(cosine_nm, sine_nm))
