"""Withheld effects for the engine on Pinocchio: the same kinds, most with other formulas."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from axisight.blind import formulas, friction_formulas, joint_formulas
from axisight.blind.formulas import Formula
from axisight.blind.machine import NOTHING, Native
from axisight.blind.scene import Drawn, Kind, Rng, Scene, between, sign, turning, unloaded
from axisight.blind.withheld import (
    BEHIND,
    KINDS,
    KINDS_ON_REQUEST,
    behind,
    on_joint,
    uneven,
    yielding,
)

DRY_STRAIN_RAD = 2e-3
"""Motor angle over which dry friction builds up after a reversal."""


Law = Callable[[Rng, Scene, int, Mapping[str, float]], Formula]


def _by(name: str, law: Law) -> Kind:
    """Return a kind of `withheld` with the same sizes and axes, but another law of its parameters."""
    kind = {**KINDS, **KINDS_ON_REQUEST}[name]

    def draw(rng: Rng, scene: Scene, axis: int) -> Drawn:
        drawn = kind.draw(rng, scene, axis)
        laws = [law(rng, scene, axis, drawn.parameters)]
        if BEHIND in drawn.parameters:
            laws = [friction_formulas.BehindGear(law) for law in laws]
        # The law replaces MuJoCo's native change.
        return replace(drawn, laws=laws, native=NOTHING)

    return replace(kind, draw=draw)


def _viscous_by_direction(
    _rng: Rng, _scene: Scene, _axis: int, values: Mapping[str, float]
) -> Formula:
    return friction_formulas.RoundedViscousByDirection(values["half_difference_nm_s_rad"], 0.05)


def _dahl(_rng: Rng, _scene: Scene, _axis: int, values: Mapping[str, float]) -> Formula:
    size = values["coulomb_nm"]
    return formulas.DahlFriction(size, size / DRY_STRAIN_RAD)


def _elements(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size, way = between(rng, 0.2, 0.7) * scene.torque(axis), yielding(rng, scene, axis)
    values = {"coulomb_nm": size, "mean_way_rad": way}
    law = friction_formulas.SlidingElements(size, way)
    return Drawn("presliding_friction", axis, values, laws=[law])


def _uneven(rng: Rng, scene: Scene, axis: int) -> Drawn:
    values = uneven(rng, scene, axis)
    law = friction_formulas.UnevenArctan(**on_joint(scene, axis, values), corner_rad_s=5e-4)
    return Drawn("position_dependent_friction", axis, values, laws=[law])


def _knee(_rng: Rng, scene: Scene, axis: int, values: Mapping[str, float]) -> Formula:
    return formulas.RoundedKnee(values["step"] * scene.stiffness(axis), values["knee_rad"])


def _gear_error(rng: Rng, _scene: Scene, _axis: int, values: Mapping[str, float]) -> Formula:
    phase = float(rng.uniform(0, 2 * np.pi))
    return formulas.GearError(values["order"], values["amplitude_rad"], phase)


def _run_out(_rng: Rng, _scene: Scene, _axis: int, values: Mapping[str, float]) -> Formula:
    cosine, sine = values["cosine_rad"], values["sine_rad"]
    return formulas.RunOut(float(np.hypot(cosine, sine)), float(np.arctan2(cosine, sine)))


def _stale(_rng: Rng, scene: Scene, _axis: int, values: Mapping[str, float]) -> Formula:
    return formulas.StaleSensor(round(values["delay_s"] / scene.robot.sample_time_s))


def _tone(rng: Rng, _scene: Scene, _axis: int, values: Mapping[str, float]) -> Formula:
    phase = float(rng.uniform(0, 2 * np.pi))
    return formulas.Tone(values["amplitude_nm"], values["frequency_hz"], phase)


def _stribeck(rng: Rng, scene: Scene, axis: int) -> Drawn:
    dry, speed = between(rng, 0.25, 0.6) * scene.torque(axis), between(rng, 2.0, 8.0)
    excess = dry * float(rng.uniform(0.5, 1.3))
    # A hyperbolic tangent as excess, a bell curve in the library: their numbers do not compare.
    values = {"coulomb_nm": dry, "tanh_excess_nm": excess, "tanh_speed_rad_s": speed}
    law = formulas.TanhStribeck(dry, excess, speed, 0.1)
    return Drawn("stribeck_friction", axis, values, laws=[law])


def _behind(drawn: Drawn) -> list[Formula]:
    return [friction_formulas.BehindGear(law) for law in drawn.laws if isinstance(law, Formula)]


def _drag(rng: Rng, scene: Scene, axis: int) -> Drawn:
    speed = scene.speed(axis)
    size = between(rng, 0.4, 1.5) * scene.of_joint(axis, "viscous_friction") * speed
    # The library's square has no parameters for the power 7/4.
    values = {"churning_nm": size, "churning_speed_rad_s": speed}
    return Drawn("quadratic_drag", axis, values, laws=[formulas.Churning(size, speed)])


def _balancer(rng: Rng, scene: Scene, axis: int) -> Drawn:
    force = sign(rng) * between(rng, 0.1, 0.6) * scene.rated_nm(axis)
    crank, free = float(rng.uniform(0.1, 0.3)), float(rng.uniform(0.3, 0.6))
    angle = float(rng.choice([0.0, rng.uniform(-0.5, 0.5)]))
    # A free length makes the torque differ from the library's sine.
    values = {"spring_nm": force, "free_length": free, "upright_rad": angle}
    law = joint_formulas.SpringBalancer(force, crank, free, angle)
    return Drawn("gravity_compensation", axis, values, laws=[law])


def _hose(rng: Rng, scene: Scene, axis: int) -> Drawn:
    stiffness, wound = between(rng, 0.05, 0.3) * scene.rated_nm(axis), between(rng, 1.0, 3.0)
    values = {"unwound_nm_rad": stiffness, "wound_rad": wound}
    law = joint_formulas.WoundHose(stiffness, wound)
    return Drawn("cable_stiffness", axis, values, laws=[law])


def _cubic(rng: Rng, scene: Scene, axis: int) -> Drawn:
    cubic = between(rng, 1.1e5, 8e5) * scene.stiffness(axis) / scene.deflection(axis) ** 2
    law = formulas.HardeningSpring(cubic)
    # The hyperbolic sine has higher orders, so that its cubic coefficient differs from the library's.
    return Drawn("nonlinear_stiffness", axis, {"third_order_nm_rad3": cubic}, laws=[law])


def _lost_motion(rng: Rng, scene: Scene, axis: int) -> Drawn:
    softness, width = between(rng, 0.4, 0.9), between(rng, 1e-4, 4e-4) * scene.deflection(axis)
    law = formulas.SmoothMiddle(softness * scene.stiffness(axis), width)
    # The width of a hyperbolic tangent does not compare with the library's.
    values = {"softness": softness, "tanh_width_rad": width}
    return Drawn("lost_motion", axis, values, laws=[law])


def _hysteresis(rng: Rng, scene: Scene, axis: int) -> Drawn:
    share, slip = between(rng, 0.15, 0.4), between(rng, 1e-4, 4e-4) * scene.deflection(axis)
    stiff = share * scene.stiffness(axis)
    law = formulas.DahlGear(stiff, stiff * slip)
    # Dahl's bristles slip on unloading too, so that their numbers do not compare with the library's.
    values = {"dahl_share": share, "dahl_deflection_rad": slip}
    return Drawn("gear_hysteresis", axis, values, Native(spring=-share), [law])


def _torque_ripple(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # Orders of slots and of pole pairs.
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
    # First order: half the imbalance at twice the electrical angle, the offset at that angle.
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


def _lag(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    lag = between(rng, 0.6e-3, 3e-3)
    return Drawn("actuator_bandwidth", axis, {"time_constant_s": lag}, Native(lag_s=lag))


def _quadratic_damper(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.05, 0.4) * scene.stiffness(axis) / scene.deflection(axis)
    law = formulas.QuadraticDamper(size)
    return Drawn("quadratic_damper", axis, {"quadratic_nm_s2_rad2": size}, laws=[law])


def _push(rng: Rng, scene: Scene, axis: int) -> Drawn:
    ratio = float(scene.robot.gear_ratio[axis - 1])
    size = sign(rng) * between(rng, 0.8, 2.5) * scene.torque(axis) / ratio
    law = formulas.Push(size, float(rng.uniform(1.0, 5.0)), float(rng.uniform(1.0, 3.0)))
    return Drawn("push", axis, {"torque_nm": size}, laws=[law])


# Kinds that stay unless a formula below replaces them; a quadratic damper replaces the cubic one.
_SHARED = {name: kind for name, kind in KINDS.items() if name != "cubic_damper"}

KINDS_BY_FORMULA: Mapping[str, Kind] = (
    _SHARED
    | {
        name: _by(name, law)
        for name, law in {
            "coulomb_friction": _dahl,
            "load_dependent_friction": lambda _r, _s, _a, v: formulas.ArctanLoadFriction(
                v["coefficient"], 0.1
            ),
            "friction_warmup": lambda _r, _s, _a, v: formulas.WarmingFriction(
                v["viscous_nm_s_rad"], v["time_constant_s"]
            ),
            "asymmetric_friction": lambda _r, _s, _a, v: formulas.OneSidedFriction(
                v["forward_nm"], v["backward_nm"], 0.1
            ),
            "extra_mode": lambda _r, _s, _a, v: joint_formulas.HungMass(
                v["inertia_kg_m2"], v["frequency_hz"], v["damping"]
            ),
            "backlash": lambda _r, _s, _a, v: formulas.Play(v["half_width_rad"]),
            "piecewise_stiffness": _knee,
            "power_supply_sag": lambda _r, _s, _a, v: formulas.WeakSupply(v["sag_1_w"]),
            "encoder_eccentricity": _run_out,
            "position_quantization": lambda _r, _s, _a, v: formulas.Counter(v["increment_rad"]),
            "transmission_error": _gear_error,
            "sensor_delay": _stale,
            "current_loop": lambda _r, _s, _a, v: formulas.ResonantLoop(
                v["time_constant_s"], v["damping"]
            ),
            "torque_offset": lambda _r, _s, _a, v: formulas.ConstantTorque(v["offset_nm"]),
            "torque_sensor_gain": lambda _r, _s, _a, v: formulas.WrongReport(
                share=1 + v["relative_error"]
            ),
            "torque_sensor_offset": lambda _r, _s, _a, v: formulas.WrongReport(
                less_nm=v["offset_nm"]
            ),
            "torque_saturation": lambda _r, _s, _a, v: formulas.CurrentLimit(v["limit_nm"]),
            "torque_deadband": lambda _r, _s, _a, v: formulas.DeadZone(v["width_nm"]),
            "outside_tone": _tone,
            "friction_step": lambda _r, _s, _a, v: formulas.LateFriction(
                v["friction_nm"], 0.1, 5.0
            ),
        }.items()
    }
    | {
        "presliding_friction": Kind(_elements),
        "position_dependent_friction": Kind(_uneven, axes=turning),
        "stribeck_friction": behind(Kind(_stribeck), _behind),
        "quadratic_drag": Kind(_drag),
        "gravity_compensation": Kind(_balancer, axes=turning),
        "cable_stiffness": Kind(_hose),
        "nonlinear_stiffness": Kind(_cubic),
        "gear_hysteresis": Kind(_hysteresis),
        "lost_motion": Kind(_lost_motion, axes=unloaded),
        "torque_ripple": Kind(_torque_ripple),
        "resolver_ripple": Kind(_resolver_ripple),
        "input_delay": Kind(_delay),
        "actuator_bandwidth": Kind(_lag),
        "quadratic_damper": Kind(_quadratic_damper, in_library=False),
        "push": Kind(_push, in_library=False),
    }
)
"""Kinds by name of the effect."""

KINDS_BY_FORMULA_ON_REQUEST: Mapping[str, Kind] = {
    "viscous_asymmetry": _by("viscous_asymmetry", _viscous_by_direction)
}
"""Kinds that cases have only where they are chosen by name."""
