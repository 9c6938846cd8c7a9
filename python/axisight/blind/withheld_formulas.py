"""What is withheld from simulators in the engine on Pinocchio: the same kinds, most by other formulas."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from axisight.blind import formulas
from axisight.blind.machine import Native
from axisight.blind.scene import Drawn, Kind, Rng, Scene, between, sign, unloaded
from axisight.blind.withheld import KINDS

# Angle of a motor over which dry friction comes after a reversal.
_STRAIN_RAD = 2e-3


def _coulomb(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.2, 0.7) * scene.torque(axis)
    law = formulas.DahlFriction(size, size / _STRAIN_RAD)
    return Drawn("coulomb_friction", axis, {"coulomb_nm": size}, laws=[law])


def _stribeck(rng: Rng, scene: Scene, axis: int) -> Drawn:
    dry, speed = between(rng, 0.25, 0.6) * scene.torque(axis), between(rng, 2.0, 8.0)
    excess = dry * float(rng.uniform(0.5, 1.3))
    # The excess falls as a hyperbolic tangent, in the library like a bell.
    values = {"coulomb_nm": dry, "tanh_excess_nm": excess, "tanh_speed_rad_s": speed}
    law = formulas.TanhStribeck(dry, excess, speed, 0.1)
    return Drawn("stribeck_friction", axis, values, laws=[law])


def _load_friction(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = between(rng, 0.03, 0.1)
    law = formulas.ArctanLoadFriction(share, 0.1)
    return Drawn("load_dependent_friction", axis, {"coefficient": share}, laws=[law])


def _warmup(rng: Rng, scene: Scene, axis: int) -> Drawn:
    own = scene.of_joint(axis, "viscous_friction")
    size, time = -own * between(rng, 0.4, 0.8), between(rng, 2.0, 6.0)
    values = {"viscous_nm_s_rad": size, "time_constant_s": time}
    return Drawn("friction_warmup", axis, values, laws=[formulas.WarmingFriction(size, time)])


def _backlash(rng: Rng, scene: Scene, axis: int) -> Drawn:
    width = between(rng, 0.8e-4, 4e-4) * scene.play(axis)
    return Drawn("backlash", axis, {"half_width_rad": width}, laws=[formulas.Play(width)])


def _cubic(rng: Rng, scene: Scene, axis: int) -> Drawn:
    cubic = between(rng, 1.1e5, 8e5) * scene.stiffness(axis) / scene.deflection(axis) ** 2
    law = formulas.HardeningSpring(cubic)
    # Where higher orders of the sine join, the library's cube is another one.
    return Drawn("nonlinear_stiffness", axis, {"third_order_nm_rad3": cubic}, laws=[law])


def _knee(rng: Rng, scene: Scene, axis: int) -> Drawn:
    step, knee = between(rng, 0.4, 1.2), between(rng, 1e-4, 5e-4) * scene.deflection(axis)
    law = formulas.RoundedKnee(step * scene.stiffness(axis), knee)
    return Drawn("piecewise_stiffness", axis, {"step": step, "knee_rad": knee}, laws=[law])


def _hysteresis(rng: Rng, scene: Scene, axis: int) -> Drawn:
    share, slip = between(rng, 0.15, 0.4), between(rng, 1e-4, 4e-4) * scene.deflection(axis)
    stiff = share * scene.stiffness(axis)
    law = formulas.DahlGear(stiff, stiff * slip)
    values = {"share": share, "deflection_rad": slip}
    return Drawn("gear_hysteresis", axis, values, Native(spring=-share), [law])


def _transmission(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.7e-4, 2e-4) * scene.play(axis)
    law = formulas.GearError(2.0, size, float(rng.uniform(0, 2 * np.pi)))
    return Drawn("transmission_error", axis, {"order": 2.0, "amplitude_rad": size}, laws=[law])


def _torque_ripple(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # Of slots and of pairs of poles.
    slots = [float(n) for n in rng.choice([6.0, 12.0, 18.0, 36.0], 2, replace=False)]
    sizes = [between(rng, 0.08, 0.3) * scene.torque(axis) for _ in slots]
    phases = [float(p) for p in rng.uniform(0, 2 * np.pi, 2)]
    values: dict[str, float] = {}
    for i, (order, size) in enumerate(sorted(zip(slots, sizes, strict=True)), 1):
        values |= {f"order_{i}": order, f"amplitude_{i}_nm": size}
    return Drawn("torque_ripple", axis, values, laws=[formulas.Cogging(slots, sizes, phases)])


def _resolver_ripple(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    pairs = int(rng.choice([1, 2, 3]))
    imbalance, offset = (sign(rng) * between(rng, 4e-4, 1.5e-3) for _ in range(2))
    # To first order: half the imbalance at twice, the offset at once the electrical angle.
    values = {
        "order_1": float(pairs),
        "amplitude_1_rad": abs(offset) / pairs,
        "order_2": 2.0 * pairs,
        "amplitude_2_rad": 0.5 * abs(imbalance) / pairs,
    }
    law = formulas.ResolverImbalance(pairs, imbalance, offset)
    return Drawn("resolver_ripple", axis, values, laws=[law])


def _delay(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    delay = between(rng, 0.5e-3, 1.6e-3)
    return Drawn("input_delay", axis, {"delay_s": delay}, laws=[formulas.DelayLine(delay)])


def _late_sensor(rng: Rng, scene: Scene, axis: int) -> Drawn:
    samples = int(rng.integers(1, 4))
    values = {"delay_s": samples * scene.robot.sample_time_s}
    return Drawn("sensor_delay", axis, values, laws=[formulas.StaleSensor(samples)])


def _lag(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    lag = between(rng, 0.6e-3, 3e-3)
    return Drawn("actuator_bandwidth", axis, {"time_constant_s": lag}, Native(lag_s=lag))


def _offset(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = sign(rng) * between(rng, 0.3, 1.0) * scene.torque(axis)
    law = formulas.ConstantTorque(size)
    return Drawn("torque_offset", axis, {"offset_nm": size}, laws=[law])


def _reported(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = sign(rng) * between(rng, 0.03, 0.1)
    law = formulas.WrongReport(share=1 + share)
    return Drawn("torque_sensor_gain", axis, {"relative_error": share}, laws=[law])


def _reported_less(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = sign(rng) * between(rng, 0.3, 1.0) * scene.torque(axis)
    law = formulas.WrongReport(less_nm=size)
    return Drawn("torque_sensor_offset", axis, {"offset_nm": size}, laws=[law])


def _limit(rng: Rng, scene: Scene, axis: int) -> Drawn:
    limit = float(rng.uniform(0.75, 0.9) * scene.largest_nm[axis - 1])
    law = formulas.CurrentLimit(limit)
    return Drawn("torque_saturation", axis, {"limit_nm": limit}, laws=[law])


def _deadband(rng: Rng, scene: Scene, axis: int) -> Drawn:
    width = between(rng, 0.2, 0.6) * scene.torque(axis)
    return Drawn("torque_deadband", axis, {"width_nm": width}, laws=[formulas.DeadZone(width)])


def _tone(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size, frequency = between(rng, 0.3, 1.0) * scene.torque(axis), float(rng.uniform(3.0, 30.0))
    law = formulas.Tone(size, frequency, float(rng.uniform(0, 2 * np.pi)))
    values = {"amplitude_nm": size, "frequency_hz": frequency}
    return Drawn("outside_tone", axis, values, laws=[law])


def _friction_step(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.4, 0.9) * scene.torque(axis)
    law = formulas.LateFriction(size, 0.1, 5.0)
    return Drawn("friction_step", axis, {"friction_nm": size}, laws=[law])


def _quadratic_damper(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.05, 0.4) * scene.stiffness(axis) / scene.deflection(axis)
    law = formulas.QuadraticDamper(size)
    return Drawn("quadratic_damper", axis, {"quadratic_nm_s2_rad2": size}, laws=[law])


def _push(rng: Rng, scene: Scene, axis: int) -> Drawn:
    ratio = float(scene.robot.gear_ratio[axis - 1])
    size = sign(rng) * between(rng, 0.8, 2.5) * scene.torque(axis) / ratio
    law = formulas.Push(size, float(rng.uniform(1.0, 5.0)), float(rng.uniform(1.0, 3.0)))
    return Drawn("push", axis, {"torque_nm": size}, laws=[law])


# Cubic dampers and what the tendons and the constraint solver of MuJoCo make are other formulas here.
_SHARED = {name: kind for name, kind in KINDS.items() if name != "cubic_damper"}

KINDS_BY_FORMULA: Mapping[str, Kind] = _SHARED | {
    "coulomb_friction": Kind(_coulomb),
    "stribeck_friction": Kind(_stribeck),
    "load_dependent_friction": Kind(_load_friction),
    "friction_warmup": Kind(_warmup),
    "backlash": Kind(_backlash),
    "nonlinear_stiffness": Kind(_cubic),
    "piecewise_stiffness": Kind(_knee, axes=unloaded),
    "gear_hysteresis": Kind(_hysteresis),
    "transmission_error": Kind(_transmission),
    "torque_ripple": Kind(_torque_ripple),
    "resolver_ripple": Kind(_resolver_ripple),
    "input_delay": Kind(_delay),
    "sensor_delay": Kind(_late_sensor),
    "actuator_bandwidth": Kind(_lag),
    "torque_offset": Kind(_offset),
    "torque_sensor_gain": Kind(_reported),
    "torque_sensor_offset": Kind(_reported_less),
    "torque_saturation": Kind(_limit),
    "torque_deadband": Kind(_deadband, axes=unloaded),
    "outside_tone": Kind(_tone, in_library=False),
    "friction_step": Kind(_friction_step, in_library=False),
    "quadratic_damper": Kind(_quadratic_damper, in_library=False),
    "push": Kind(_push, in_library=False),
}
"""By name."""
