"""Withheld effects by name: the ranges from which their sizes are drawn, and their laws.

Ranges are those of industrial robots. On the three-axis preset:

- friction of 0.1 to 0.5 of the rated torque (Armstrong-Helouvry 1991),
- lost motion of harmonic and cycloidal gears up to 1 arc minute,
- transmission errors of 0.5 arc minutes,
- ripple of a few per cent of the rated torque,
- delays of 1 to 3 samples.

On other arms the ranges scale with motors and gears (`Scene`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from axisight.blind import friction_laws, joint_laws, laws
from axisight.blind.arm_mjcf import STEPS_PER_SAMPLE
from axisight.blind.machine import NOTHING, Ends, Native
from axisight.blind.scene import (
    Draw,
    Drawn,
    Kind,
    Rng,
    Scene,
    between,
    everywhere,
    sign,
    turning,
    unloaded,
)

# A slide's displacement before slip [m] per radian on revolute axes.
_SLIDE_M = 0.25


def _coulomb(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.2, 0.7) * scene.torque(axis)
    return Drawn("coulomb_friction", axis, {"coulomb_nm": size}, Native(friction_nm=size))


def _stribeck(rng: Rng, scene: Scene, axis: int) -> Drawn:
    dry, speed = between(rng, 0.25, 0.6) * scene.torque(axis), between(rng, 2.0, 8.0)
    excess = dry * float(rng.uniform(0.5, 1.3))
    # Exponential excess, a bell curve in the library: their numbers do not compare.
    values = {"coulomb_nm": dry, "exponential_excess_nm": excess, "decay_speed_rad_s": speed}
    law = laws.ExponentialStribeck(dry, dry + excess, speed, 0.05)
    return Drawn("stribeck_friction", axis, values, laws=[law])


BEHIND = "arm_share"
"""Parameter for friction that acts behind the gear."""

# One of so many draws of dry friction acts behind the gear.
_BEHIND_ONE_IN = 3


def behind(kind: Kind, moved: Callable[[Drawn], Sequence[object]]) -> Kind:
    """Return a kind of friction that some draws put behind the gear, with the laws that ``moved`` returns."""

    def draw(rng: Rng, scene: Scene, axis: int) -> Drawn:
        drawn = kind.draw(rng, scene, axis)
        if rng.random() >= 1 / _BEHIND_ONE_IN:
            return drawn
        values = {**drawn.parameters, BEHIND: 1.0}
        return replace(drawn, parameters=values, laws=moved(drawn), native=NOTHING)

    return replace(kind, draw=draw)


def _behind(drawn: Drawn) -> list[friction_laws.BehindGear]:
    """Return the laws of a friction behind the gear; MuJoCo's native friction becomes a law with a corner."""
    size = drawn.native.friction_nm
    there = [laws.OneSidedFriction(size, size, 0.05)] if size else drawn.laws
    return [friction_laws.BehindGear(law) for law in there if isinstance(law, laws.Law)]


def _bristles(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.2, 0.7) * scene.torque(axis)
    way = yielding(rng, scene, axis)
    # The displacement belongs to another law than the library's, hence another name.
    values = {"coulomb_nm": size, "elastoplastic_rad": way}
    law = friction_laws.ElastoPlastic(size, way)
    return Drawn("presliding_friction", axis, values, laws=[law])


def yielding(rng: Rng, scene: Scene, axis: int) -> float:
    """Draw the motor angle [rad] before friction slips, of the size of a gear's play.

    On a slide this is 40 to 150 micrometres. Friction that slips much earlier is dry friction in any formula.
    """
    ratio = abs(float(scene.robot.gear_ratio[axis - 1]))
    unit = _SLIDE_M if scene.robot.axis_is_prismatic[axis - 1] else 1.0
    return between(rng, 1.5e-4, 6e-4) * unit / ratio


def _uneven(rng: Rng, scene: Scene, axis: int) -> Drawn:
    values = uneven(rng, scene, axis)
    law = friction_laws.UnevenFriction(**on_joint(scene, axis, values), corner_rad_s=1e-3)
    return Drawn("position_dependent_friction", axis, values, laws=[law])


def uneven(rng: Rng, scene: Scene, axis: int) -> dict[str, float]:
    """Draw uneven dry friction: mean [Nm, motor side], relative change [1], waves [1/rad], phase [rad]."""
    size, travel = between(rng, 0.3, 0.8) * scene.torque(axis), scene.travel(axis)
    return {
        "mean_nm": size,
        "changes_by": float(rng.uniform(0.5, 0.9)),
        "waves_1_rad": float(rng.uniform(0.4, 1.2)) * 2 * np.pi / travel,
        "phase_rad": float(rng.uniform(0, 2 * np.pi)),
    }


def on_joint(scene: Scene, axis: int, values: Mapping[str, float]) -> dict[str, float]:
    """Return the arguments of an uneven friction law, on the joint side."""
    ratio = abs(float(scene.robot.gear_ratio[axis - 1]))
    size, share, waves, phase = values.values()
    return {"dry_nm": size / ratio, "share": share, "waves": waves, "phase": phase}


def _viscous(rng: Rng, scene: Scene, axis: int) -> Drawn:
    share = between(rng, 0.4, 1.5)
    own = scene.of_joint(axis, "viscous_friction")
    values = {"viscous_nm_s_rad": share * own}
    return Drawn("viscous_friction", axis, values, Native(viscous=share))


def _load_friction(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = between(rng, 0.03, 0.1)
    law = laws.LoadFriction(share, 0.05)
    return Drawn("load_dependent_friction", axis, {"coefficient": share}, laws=[law])


def _asymmetric(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.3, 0.8) * scene.torque(axis)
    more = sign(rng) * float(rng.uniform(0.2, 0.6))
    values = {"forward_nm": size * (1 + more), "backward_nm": size * (1 - more)}
    law = laws.OneSidedFriction(values["forward_nm"], values["backward_nm"], 0.05)
    return Drawn("asymmetric_friction", axis, values, laws=[law])


def _viscous_by_direction(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # Less than the simulator's friction, so that friction takes power in both directions.
    own = scene.of_joint(axis, "viscous_friction")
    more = sign(rng) * between(rng, 0.3, 0.9) * own
    values = {"half_difference_nm_s_rad": more}
    law = friction_laws.ViscousByDirection(more, -more)
    return Drawn("viscous_asymmetry", axis, values, laws=[law])


def _drag(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # About as much as the simulator's friction at the largest speed.
    share = between(rng, 0.4, 1.5) * scene.of_joint(axis, "viscous_friction")
    drag = share / scene.speed(axis)
    return Drawn("quadratic_drag", axis, {"drag_nm_s2_rad2": drag}, laws=[laws.Drag(drag)])


def _balancer(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = sign(rng) * between(rng, 0.05, 0.3) * scene.rated_nm(axis)
    # Most balancers are upright at the zero of their axis.
    angle = float(rng.choice([0.0, rng.uniform(-0.5, 0.5)]))
    values = {"sine_nm": size * float(np.cos(angle)), "cosine_nm": size * float(np.sin(angle))}
    law = joint_laws.Balancer(values["sine_nm"], values["cosine_nm"])
    return Drawn("gravity_compensation", axis, values, laws=[law])


def _cable(rng: Rng, scene: Scene, axis: int) -> Drawn:
    stiffness = between(rng, 0.05, 0.3) * scene.rated_nm(axis)
    rest = float(rng.uniform(-0.3, 0.3))
    values = {"stiffness_nm_rad": stiffness, "at_zero_nm": stiffness * rest}
    law = joint_laws.Cable(stiffness, rest)
    return Drawn("cable_stiffness", axis, values, laws=[law])


def _swinging(rng: Rng, scene: Scene, axis: int) -> Drawn:
    ratio = float(scene.robot.gear_ratio[axis - 1])
    inertia = between(rng, 0.05, 0.3) * scene.of_joint(axis, "motor_inertia") / ratio**2
    values = {
        "inertia_kg_m2": inertia,
        "frequency_hz": between(rng, 6.0, 30.0),
        "damping": between(rng, 0.01, 0.1),
    }
    law = joint_laws.Swing(inertia, values["frequency_hz"], values["damping"])
    return Drawn("extra_mode", axis, values, laws=[law])


def _tilt(rng: Rng, _scene: Scene, _axis: int) -> Drawn:
    # One to three degrees, as of a base plate that nobody levelled.
    about = [sign(rng) * between(rng, 0.015, 0.05) for _ in range(2)]
    values = {"about_x_rad": about[0], "about_y_rad": about[1]}
    return Drawn("base_tilt", None, values, ends=Ends(tilted_rad=(about[0], about[1])))


def _backlash(rng: Rng, scene: Scene, axis: int) -> Drawn:
    width = between(rng, 0.8e-4, 4e-4) * scene.play(axis)
    return Drawn("backlash", axis, {"half_width_rad": width}, Native(half_width_rad=width))


def _cubic(rng: Rng, scene: Scene, axis: int) -> Drawn:
    unit = scene.stiffness(axis) / scene.deflection(axis) ** 2
    cubic = between(rng, 1.1e5, 8e5) * unit
    law = laws.CubicSpring(cubic)
    return Drawn("nonlinear_stiffness", axis, {"cubic_nm_rad3": cubic}, laws=[law])


def _knee(rng: Rng, scene: Scene, axis: int) -> Drawn:
    step, knee = between(rng, 0.4, 1.2), between(rng, 1e-4, 5e-4) * scene.deflection(axis)
    law = laws.KneeSpring(step * scene.stiffness(axis), knee)
    return Drawn("piecewise_stiffness", axis, {"step": step, "knee_rad": knee}, laws=[law])


def _lost_motion(rng: Rng, scene: Scene, axis: int) -> Drawn:
    softness, width = between(rng, 0.4, 0.9), between(rng, 1e-4, 4e-4) * scene.deflection(axis)
    law = laws.SoftMiddle(softness * scene.stiffness(axis), width)
    values = {"softness": softness, "half_width_rad": width}
    return Drawn("lost_motion", axis, values, laws=[law])


def _sag(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # The supply drops by 0.1 to 0.5 at the largest power.
    share = between(rng, 0.1, 0.5) / (scene.speed(axis) * float(scene.largest_nm[axis - 1]))
    return Drawn("power_supply_sag", axis, {"sag_1_w": share}, laws=[laws.Sag(share)])


def _eccentric(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    # 0.1 to 0.5 mm on a disc of 25 mm.
    run_out, phase = between(rng, 4e-3, 2e-2), float(rng.uniform(0, 2 * np.pi))
    law = laws.EccentricDisc(run_out, phase)
    values = {"cosine_rad": run_out * np.sin(phase), "sine_rad": run_out * np.cos(phase)}
    return Drawn("encoder_eccentricity", axis, {k: float(v) for k, v in values.items()}, laws=[law])


def _few_lines(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    line = 2 * np.pi / 2.0 ** float(rng.integers(12, 17))
    return Drawn("position_quantization", axis, {"increment_rad": line}, laws=[laws.FewLines(line)])


def _coupled(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = sign(rng) * between(rng, 0.02, 0.2)
    return Drawn("axis_coupling", axis, {"share": share}, Native(turns_next=share))


def _fast_clock(rng: Rng, _scene: Scene, _axis: int) -> Drawn:
    # From an uncalibrated quartz to a busy computer's clock.
    fast = sign(rng) * between(rng, 3e-5, 1e-3)
    return Drawn("clock_drift", None, {"relative_rate": fast}, fast=fast)


def _zero(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    offset = sign(rng) * between(rng, 0.02, 0.1)
    return Drawn("joint_zero_offset", axis, {"offset_rad": offset}, Native(zero_rad=offset))


def _softer(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = sign(rng) * between(rng, 0.08, 0.25)
    return Drawn("joint_stiffness", axis, {"relative_change": share}, Native(spring=share))


def _damping(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = between(rng, 0.5, 2.0)
    return Drawn("joint_damping", axis, {"relative_change": share}, Native(damper=share))


def _hysteresis(rng: Rng, scene: Scene, axis: int) -> Drawn:
    share, slip = between(rng, 0.15, 0.4), between(rng, 1e-4, 4e-4) * scene.deflection(axis)
    stiff = share * scene.stiffness(axis)
    slips = slip * np.array([0.4, 0.8, 1.2, 1.6])
    law = laws.MaxwellSlip([stiff / 4] * 4, list(slips))
    # The slipping part comes out of the spring.
    native = Native(spring=-share)
    return Drawn("gear_hysteresis", axis, {"share": share, "deflection_rad": slip}, native, [law])


def _transmission(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.7e-4, 2e-4) * scene.play(axis)
    phase = float(rng.uniform(0, 2 * np.pi))
    conserves = bool(rng.integers(2))
    # Strain wave gears have two waves per motor turn; other gears differ.
    order = float(rng.choice([1.0, 2.0, 2.0, 3.0]))
    law = laws.GearWave(scene.stiffness(axis), order, size, phase, conserves)
    return Drawn("transmission_error", axis, {"order": order, "amplitude_rad": size}, laws=[law])


def _waves(rng: Rng, low: float, high: float) -> tuple[list[float], list[float], list[float]]:
    count = int(rng.integers(1, 4))
    orders = sorted(rng.choice([1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 24.0], count, replace=False))
    sizes = [between(rng, low, high) for _ in orders]
    phases = rng.uniform(0, 2 * np.pi, count).tolist()
    return [float(n) for n in orders], sizes, phases


def _terms(waves: tuple[list[float], list[float], list[float]], unit: str) -> dict[str, float]:
    out: dict[str, float] = {}
    for i, (order, size, _) in enumerate(zip(*waves, strict=True), 1):
        out |= {f"order_{i}": order, f"amplitude_{i}_{unit}": size}
    return out


def _torque_ripple(rng: Rng, scene: Scene, axis: int) -> Drawn:
    waves = _waves(rng, 0.08 * scene.torque(axis), 0.3 * scene.torque(axis))
    return Drawn("torque_ripple", axis, _terms(waves, "nm"), laws=[laws.MotorWave(*waves)])


def _resolver_ripple(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    waves = _waves(rng, 1.5e-4, 6e-4)
    return Drawn("resolver_ripple", axis, _terms(waves, "rad"), laws=[laws.SensorWave(*waves)])


def _delay(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # Whole engine steps: one to three samples.
    delay = float(rng.integers(2, 7)) * scene.robot.sample_time_s / STEPS_PER_SAMPLE
    return Drawn("input_delay", axis, {"delay_s": delay}, laws=[laws.Delay(delay)])


def _late_sensor(rng: Rng, scene: Scene, axis: int) -> Drawn:
    samples = int(rng.integers(1, 4))
    delay = samples * scene.robot.sample_time_s
    return Drawn("sensor_delay", axis, {"delay_s": delay}, laws=[laws.LateSensor(samples)])


def _lag(rng: Rng, scene: Scene, axis: int) -> Drawn:
    lag = between(rng, 0.6e-3, 3e-3)
    # The engine holds an activation over its step, which delays torque by half a step.
    held = 0.5 * scene.robot.sample_time_s / STEPS_PER_SAMPLE
    return Drawn("actuator_bandwidth", axis, {"time_constant_s": lag + held}, Native(lag_s=lag))


def _loop(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    # A drive tuned for an overshoot of about 0.1 or less.
    lag, damping = between(rng, 0.5e-3, 2e-3), float(rng.uniform(0.3, 0.8))
    values = {"time_constant_s": lag, "damping": damping}
    return Drawn("current_loop", axis, values, laws=[laws.ResonantLoop(lag, damping)])


def _constant(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = sign(rng) * between(rng, 0.03, 0.1)
    return Drawn("torque_constant", axis, {"relative_error": share}, Native(gear=share))


def _reported(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = sign(rng) * between(rng, 0.03, 0.1)
    law = laws.Reported(1 + share)
    return Drawn("torque_sensor_gain", axis, {"relative_error": share}, laws=[law])


def _offset(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = sign(rng) * between(rng, 0.3, 1.0) * scene.torque(axis)
    return Drawn("torque_offset", axis, {"offset_nm": size}, laws=[laws.Offset(size)])


def _reported_less(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = sign(rng) * between(rng, 0.3, 1.0) * scene.torque(axis)
    law = laws.ReportedLess(size)
    return Drawn("torque_sensor_offset", axis, {"offset_nm": size}, laws=[law])


def _inertia(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    share = between(rng, 0.08, 0.25)
    return Drawn("motor_inertia", axis, {"relative_change": share}, Native(armature=share))


def _payload(rng: Rng, scene: Scene, _axis: int) -> Drawn:
    # More than the last link's tolerance (1.5 % of 680 kg), which is production scatter.
    mass = between(rng, 0.075, 0.22) * scene.last_kg
    link = next(j.link for j in reversed(scene.robot.joints) if j.link is not None)
    x, y, z = (float(c + rng.uniform(-0.3, 0.3) * scene.reach) for c in link.com_m)
    values = {"mass_kg": mass, "x_m": x, "y_m": y, "z_m": z}
    return Drawn("payload", None, values, ends=Ends(tip_kg=mass, tip_m=(x, y, z)))


def _of_link(scene: Scene, axis: int, quantity: str) -> tuple[str, float]:
    """Return name and nominal value of a parameter of an axis's link."""
    name = scene.robot.axis_parameter(axis, quantity)
    assert name is not None  # every axis of the preset moves a link
    return name, scene.robot.parameters()[name]


def _link_share(effect: str, quantity: str, low: float, high: float) -> Draw:
    def draw(rng: Rng, scene: Scene, axis: int) -> Drawn:
        share = between(rng, low, high)
        name, nominal = _of_link(scene, axis, quantity)
        changed = {name: nominal * (1 + share)}
        return Drawn(effect, axis, {"relative_change": share}, changed=changed)

    return draw


def _link_com(rng: Rng, scene: Scene, axis: int) -> Drawn:
    shift = {f"{k}_m": sign(rng) * between(rng, 0.02, 0.08) * scene.reach for k in "xyz"}
    changed = {}
    for key, size in shift.items():
        name, nominal = _of_link(scene, axis, f"com_{key[0]}")
        changed[name] = nominal + size
    return Drawn("link_com", axis, shift, changed=changed)


def _length(rng: Rng, scene: Scene, axis: int) -> Drawn:
    shift = {f"{k}_m": sign(rng) * between(rng, 0.01, 0.05) * scene.reach for k in "xyz"}
    native = Native(longer_m=(shift["x_m"], shift["y_m"], shift["z_m"]))
    return Drawn("link_geometry", axis, shift, native)


def _rocking(rng: Rng, scene: Scene, _axis: int) -> Drawn:
    about = [between(rng, 2e-8, 2e-7) / scene.weight for _ in range(2)]
    damping = between(rng, 5e-4, 4e-3)
    values = {"about_x_rad_nm": about[0], "about_y_rad_nm": about[1], "damping_s": damping}
    return Drawn(
        "base_compliance",
        None,
        values,
        ends=Ends(rocks_rad_nm=(about[0], about[1]), rocks_s=damping),
    )


def _warmup(rng: Rng, scene: Scene, axis: int) -> Drawn:
    own = scene.of_joint(axis, "viscous_friction")
    size, time = -own * between(rng, 0.4, 0.8), between(rng, 2.0, 6.0)
    values = {"viscous_nm_s_rad": size, "time_constant_s": time}
    return Drawn("friction_warmup", axis, values, laws=[laws.Warmup(size, time)])


def _gains(rng: Rng, _scene: Scene, axis: int) -> Drawn:
    kp, ki = (sign(rng) * between(rng, 0.08, 0.3) for _ in range(2))
    values = {"relative_proportional": kp, "relative_integral": ki}
    return Drawn("controller_gain", axis, values, Native(kp=kp, ki=ki))


def _speed_filter(rng: Rng, scene: Scene, axis: int) -> Drawn:
    lag, sample = between(rng, 1e-3, 5e-3), scene.robot.sample_time_s
    # The engine's lag is exact; the library states that of a backward difference with the same decay.
    stated = sample / -float(np.expm1(-sample / lag)) - sample
    return Drawn("velocity_filter", axis, {"time_constant_s": stated}, Native(filter_s=lag))


def _fed_forward(rng: Rng, scene: Scene, axis: int) -> Drawn:
    rate = between(rng, 0.2, 1.0) * scene.of_joint(axis, "motor_inertia")
    speed = between(rng, 0.3, 1.0) * scene.of_joint(axis, "viscous_friction")
    values = {"acceleration_nm_s2_rad": rate, "speed_nm_s_rad": speed}
    return Drawn("feedforward_missing", axis, values, Native(for_rate=rate, for_speed=speed))


def _limit(rng: Rng, scene: Scene, axis: int) -> Drawn:
    # Relative to the torque beyond holding: a motor that cannot hold its arm only logs its limit.
    held, largest = scene.at_rest_nm(axis), float(scene.largest_nm[axis - 1])
    limit = held + float(rng.uniform(0.75, 0.9)) * max(largest - held, 0.0)
    return Drawn("torque_saturation", axis, {"limit_nm": limit}, laws=[laws.Limit(limit)])


def _deadband(rng: Rng, scene: Scene, axis: int) -> Drawn:
    width = between(rng, 0.2, 0.6) * scene.torque(axis)
    return Drawn("torque_deadband", axis, {"width_nm": width}, laws=[laws.Deadband(width)])


def _tone(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size, frequency = between(rng, 0.3, 1.0) * scene.torque(axis), float(rng.uniform(3.0, 30.0))
    law = laws.Tone(size, frequency, float(rng.uniform(0, 2 * np.pi)))
    return Drawn(
        "outside_tone", axis, {"amplitude_nm": size, "frequency_hz": frequency}, laws=[law]
    )


def _friction_step(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 0.4, 0.9) * scene.torque(axis)
    return Drawn(
        "friction_step", axis, {"friction_nm": size}, laws=[laws.FrictionStep(size, 0.05, 5.0)]
    )


def _cubic_damper(rng: Rng, scene: Scene, axis: int) -> Drawn:
    size = between(rng, 1.1, 11.0) * scene.stiffness(axis) / scene.deflection(axis) ** 2
    return Drawn("cubic_damper", axis, {"cubic_nm_s3_rad3": size}, laws=[laws.CubicDamper(size)])


KINDS: Mapping[str, Kind] = {
    "coulomb_friction": behind(Kind(_coulomb), _behind),
    "stribeck_friction": behind(Kind(_stribeck), _behind),
    "presliding_friction": Kind(_bristles),
    "position_dependent_friction": Kind(_uneven, axes=turning),
    "viscous_friction": Kind(_viscous),
    "load_dependent_friction": Kind(_load_friction),
    "asymmetric_friction": behind(Kind(_asymmetric), _behind),
    "quadratic_drag": Kind(_drag),
    "gravity_compensation": Kind(_balancer, axes=turning),
    "cable_stiffness": Kind(_cable),
    "extra_mode": Kind(_swinging),
    "base_tilt": Kind(_tilt),
    "backlash": Kind(_backlash),
    "nonlinear_stiffness": Kind(_cubic),
    "joint_stiffness": Kind(_softer),
    "joint_damping": Kind(_damping),
    "gear_hysteresis": Kind(_hysteresis),
    "transmission_error": Kind(_transmission),
    "torque_ripple": Kind(_torque_ripple),
    "resolver_ripple": Kind(_resolver_ripple),
    "input_delay": Kind(_delay),
    "actuator_bandwidth": Kind(_lag),
    "current_loop": Kind(_loop),
    "torque_constant": Kind(_constant),
    "torque_offset": Kind(_offset),
    "motor_inertia": Kind(_inertia),
    "payload": Kind(_payload),
    "torque_saturation": Kind(_limit),
    "torque_deadband": Kind(_deadband, axes=unloaded),
    "controller_gain": Kind(_gains),
    "velocity_filter": Kind(_speed_filter),
    # More than the production scatter of the link.
    "link_mass": Kind(_link_share("link_mass", "mass", 0.08, 0.3)),
    "link_inertia": Kind(_link_share("link_inertia", "inertia_scale", 0.2, 0.8)),
    "link_com": Kind(_link_com),
    "link_geometry": Kind(_length, axes=lambda scene: everywhere(scene)[:-1]),
    "base_compliance": Kind(_rocking),
    "friction_warmup": Kind(_warmup),
    "piecewise_stiffness": Kind(_knee, axes=unloaded),
    "lost_motion": Kind(_lost_motion, axes=unloaded),
    "power_supply_sag": Kind(_sag),
    "encoder_eccentricity": Kind(_eccentric, axes=turning),
    "position_quantization": Kind(_few_lines),
    "axis_coupling": Kind(_coupled, axes=lambda scene: everywhere(scene)[:-1], alone=True),
    "clock_drift": Kind(_fast_clock),
    "joint_zero_offset": Kind(_zero, axes=turning),
    "torque_sensor_gain": Kind(_reported),
    "sensor_delay": Kind(_late_sensor),
    "torque_sensor_offset": Kind(_reported_less),
    "feedforward_missing": Kind(_fed_forward),
    "outside_tone": Kind(_tone, in_library=False),
    "friction_step": Kind(_friction_step, in_library=False),
    "cubic_damper": Kind(_cubic_damper, in_library=False),
}
"""Kinds by name of the effect."""

KINDS_ON_REQUEST: Mapping[str, Kind] = {"viscous_asymmetry": Kind(_viscous_by_direction)}
"""Kinds that cases have only where they are chosen by name."""

BY_REFERENCES = frozenset(
    {
        "clock_drift",
        "controller_gain",
        "feedforward_missing",
        "torque_saturation",
        "torque_sensor_gain",
        "torque_sensor_offset",
        "velocity_filter",
    }
)
"""Effects that only references show, or that are part of the logged torque."""
