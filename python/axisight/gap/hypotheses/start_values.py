"""Start values, bounds and priors of effects from data: one table entry per effect.

An entry takes a :class:`StartContext` and returns the effect with what is free in it, or None where the
data have nothing to start from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.effects.stated import BEHIND_GEAR, BRISTLES, PLAY
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.hypotheses.friction_waves import wave_of_friction
from axisight.gap.hypotheses.ripple_orders import passed, strongest_orders
from axisight.gap.hypotheses.start_context import StartContext, StartData
from axisight.gap.signals.lowpass_cutoff import rigid_below_hz
from axisight.robot import Robot

Array = NDArray[np.float64]


def _neutral(trial: StartContext) -> Hypothesis:
    """Begin at the neutral values, everything free."""
    parameters = trial.info.parameters
    values = {p.name: p.neutral for p in parameters}
    return Hypothesis(trial.effect(values), tuple(values))


def _before_the_last(trial: StartContext) -> Hypothesis | None:
    """Begin at the neutral values; the last link carries no axis."""
    return _neutral(trial) if trial.index + 1 < trial.robot.n_axes else None


def _law(**shares: float) -> Callable[[StartContext], Hypothesis]:
    """Begin at neutral values, and behind the gear; speeds that shape a friction law are shares of the speeds seen."""

    def start(trial: StartContext) -> Hypothesis:
        top = max(float(np.abs(x[trial.index].speed_rad_s).max()) for x in trial.at.turning) or 1.0
        found = {name: share * top for name, share in shares.items()}
        values = {p.name: p.neutral for p in trial.info.parameters} | found
        bounds = {name: (0.1 * value, 10 * value) for name, value in found.items()}
        starts = ({BEHIND_GEAR: 1.0},) if BEHIND_GEAR in values else ()
        return Hypothesis(trial.effect(values), tuple(values), bounds=bounds, starts=starts)

    return start


# Of the top speed of an axis: the corner of dry friction, and the speed over which friction falls.
_SMOOTHING, _STRIBECK = 0.003, 0.1
# Friction falls with speed over a thousandth to a tenth of the top speed, by grease and load; over more of that of
# slow motions.
_STRIBECK_STARTS = (0.003, 0.01, 0.03, 0.3)


def _stribeck(trial: StartContext) -> Hypothesis:
    """Begin as a law with several speeds over which friction falls: a fit does not cross decades."""
    name = "stribeck_speed_rad_s"
    begin = _law(smoothing_rad_s=_SMOOTHING, **{name: _STRIBECK})(trial)
    speed = float((begin.effect.parameters or {})[name])
    starts = tuple(
        {name: share / _STRIBECK * speed, **side}
        for share in _STRIBECK_STARTS
        for side in ({}, *begin.starts)
    )
    bounds = {**begin.bounds, name: (0.1 * starts[0][name], 10 * speed)}
    return replace(begin, bounds=bounds, starts=starts)


# Ways over which bristles yield, of the travel of the motor: less is dry friction, more a spring.
_YIELDING = (3e-4, 1.5e-3, 6e-3)


def _presliding(trial: StartContext) -> Hypothesis:
    """Begin with several ways before it slips, as a law without a break-away; no step skips its slipping."""
    _, way, relaxation = BRISTLES
    travel = max(float(np.ptp(x[trial.index].angle_rad)) for x in trial.at.turning)
    starts = tuple({way: share * max(travel, 1e-3)} for share in _YIELDING)
    values = {p.name: p.neutral for p in trial.info.parameters} | starts[1]
    values[relaxation] = trial.robot.sample_time_s
    return Hypothesis(
        trial.effect(values),
        ("coulomb_nm", way, "bristle_time_s"),
        bounds={way: (0.5 * starts[0][way], 5 * starts[-1][way]), "bristle_time_s": (0.0, 0.1)},
        starts=(starts[0], starts[2]),
    )


# Of the longest wave on a slide.
_SLIDE_TURNS = 2.0


def _waves(trial: StartContext) -> Hypothesis | None:
    """Begin with the strongest orders of the residual over the motor angle."""
    terms = trial.info.terms().values()
    orders = _orders(trial, len(terms))
    if not orders:
        return None
    # Terms without an order are switched off.
    values = {p.name: 0.0 for p in trial.info.parameters if p.name.startswith("order")}
    free: list[str] = []
    for n, (order, *waves) in zip(orders, terms, strict=False):
        values[order] = float(n)
        free += waves
    return Hypothesis(trial.effect(values | dict.fromkeys(free, 0.0)), tuple(free))


def _orders(trial: StartContext, count: int) -> list[int]:
    """Return the strongest orders of the residual over the motor angle, as the effect shows in it."""
    logs, responses = trial.turned()
    # On a slide, whose angle may be metres, a wave longer than the travel is any shape.
    least = _SLIDE_TURNS if trial.robot.axis_is_prismatic[trial.index] else 0.0
    return strongest_orders(logs, responses, count=count, least_turns=least)


# As harmonic drives have it.
_TWICE = 2


def _gear_waves(trial: StartContext) -> Hypothesis:
    """Begin with the two strongest orders of the residual over the motor angle, else twice a motor turn."""
    waves = tuple(p.name for p in trial.info.parameters if p.role == "amplitude")
    first, *others = _orders(trial, 2) or [_TWICE]
    values = {"order": float(first), "returned": 0.5, **dict.fromkeys(waves, 0.0)}
    values["second_ratio"] = others[0] / first if others else float(_TWICE)
    # Gears conserve power or pass torque at the nominal ratio: either is as good a guess.
    return Hypothesis(trial.effect(values), (*waves, "returned"), {"returned": (0.5, 0.5)})


# An axis with less of the error than this is not worth many starts.
_SMALL_SHARE = 0.1


# A tenth of it, where searches begin, is ten times the least that effects take.
_LEAST_DEFLECTION_RAD = 1e-4
# Play may be that of a gear that is bent far less; this is next to nothing.
_HARDLY_BENT_RAD = 1e-6


def _stiffness(trial: StartContext) -> float:
    robot = trial.robot
    return robot.parameters()[f"{robot.axis_names[trial.index]}.stiffness"]


def _deflection_rad(trial: StartContext, size: Callable[[Array], Any] = np.std) -> float:
    """Return the deflection of the gear under the torque of the log that moves it most, by ``size``.

    Not less than what shapes of gears are stated for.
    """
    return max(_bent_rad(trial, size), _LEAST_DEFLECTION_RAD)


def _bent_rad(trial: StartContext, size: Callable[[Array], Any] = np.std) -> float:
    """Return the same, however small."""
    ratio = abs(float(trial.robot.gear_ratio[trial.index]))
    most = max(float(size(torque)) for torque in trial.torque())
    return max(most / ratio / _stiffness(trial), _HARDLY_BENT_RAD)


# Beyond these shares of the samples torques say little of a gear's law.
_HARDLY_EVER = (0.005, 0.995)


def _of_a_gear(trial: StartContext) -> Hypothesis:
    """Begin at the neutral values, and say between which deflections the gear works."""
    torque = np.concatenate(trial.torque()) / float(trial.robot.gear_ratio[trial.index])
    low, high = np.quantile(torque / _stiffness(trial), _HARDLY_EVER)
    return replace(_neutral(trial), deflections_rad=(float(low), float(high)))


# Largest half-width of the play of an industrial gear, 3 minutes of arc.
_WIDEST_RAD = 9e-4
# From one start to the next: the valley around the true width is narrow, impacts must stay in phase.
_WIDER = 1.24


def _play(trial: StartContext) -> Hypothesis:
    """Begin at several widths, from a share of the deflection the largest torque gives.

    Up to most of it, or the play of a gear that is stiffer than that; by teeth that rebound, and by such as
    a film of grease stops, whose motion is another where gravity lets them fall from side to side. What is
    damped in the gap is found where it ended.
    """
    i, deflection = trial.index, _bent_rad(trial)
    begin = replace(_of_a_gear(trial), free=("half_width_rad",))
    if _axis_share(trial.at, i) <= _SMALL_SHARE:
        return begin
    widest = 0.8 * deflection
    if not trial.robot.axis_is_prismatic[i]:
        widest = max(widest, _WIDEST_RAD)
    count = 1 + round(np.log(widest / (0.04 * deflection)) / np.log(_WIDER))
    widths = np.geomspace(0.04 * deflection, widest, count)
    rebounding = [{"half_width_rad": float(w), PLAY[1]: 0.0} for w in widths]
    stopped = [{"half_width_rad": float(w), PLAY[1]: 1.0} for w in widths[::2]]
    return replace(begin, starts=(*rebounding, *stopped))


# A cube as stiff at the deflection as so many linear springs: near one, a step from none of it says little.
_HARDER = (1.0, 3.0, 10.0, 30.0)


def _with_weight(torque: Array) -> float:
    """Return the size of a torque whose mean bends a spring as what varies does."""
    return float(np.sqrt(np.mean(torque**2)))


def _hardening(trial: StartContext) -> Hypothesis:
    """Begin without, or where the cube is most of the spring."""
    begin = _of_a_gear(trial)
    if _axis_share(trial.at, trial.index) <= _SMALL_SHARE:
        return begin
    unit = _stiffness(trial) / _deflection_rad(trial, _with_weight) ** 2
    return replace(begin, starts=tuple({"cubic_nm_rad3": share * unit} for share in _HARDER))


# Where slipping begins in earnest, as shares of the deflection: far below, it is dry friction;
# far above, a stiffer spring.
_SLIPS = (0.1, 0.4, 1.6)


def _slip(trial: StartContext) -> Hypothesis:
    """Begin at several deflections at which the gear slips."""
    name, deflection = "deflection_rad", _deflection_rad(trial)
    less, first, *more = ({name: share * deflection} for share in _SLIPS)
    bounds = {name: (0.1 * _SLIPS[0] * deflection, 10 * _SLIPS[-1] * deflection)}
    begin = trial.effect(
        {"share": 0.0, "included": 0.5, "sharpness": 0.5, "strain_at_rest": 0.0, **first}
    )
    # Stiffness comes from small motions, which feel the whole spring, or from large ones.
    return Hypothesis(
        begin,
        ("share", name, "included", "sharpness", "strain_at_rest"),
        {"included": (0.5, 0.5), "sharpness": (0.5, 0.5), "strain_at_rest": (0.0, 0.5)},
        bounds,
        starts=(less, *more),
    )


# Where a gear's stiffness has its knee, as shares of the deflection.
_KNEES = (0.1, 0.35, 1.2)


def _knee(trial: StartContext) -> Hypothesis:
    """Begin at several deflections beyond which the gear is another spring."""
    name, deflection = "knee_rad", _deflection_rad(trial)
    starts = tuple({name: share * deflection} for share in _KNEES)
    bounds = {name: (0.3 * starts[0][name], 3 * starts[-1][name])}
    begin = trial.effect({"step": 0.0, "within": 0.0, **starts[1]})
    further = (starts[0], starts[2])
    return replace(_of_a_gear(trial), effect=begin, bounds=bounds, starts=further)


# Half-widths of a soft middle, as shares of the deflection: its corner has to be passed.
_MIDDLES = (0.05, 0.15, 0.45)
# Teeth that come into contact one after another, and all at once.
_ROUNDED = (0.5, 0.05)


def _soft(trial: StartContext) -> Hypothesis:
    """Begin at several widths of a middle that is as stiff as the rest."""
    name, deflection = "half_width_rad", _deflection_rad(trial)
    starts = [
        {name: share * deflection, "rounding": rounding}
        for rounding in _ROUNDED
        for share in _MIDDLES
    ]
    # The largest torques turn a gear by several times its deviation.
    bounds = {name: (0.3 * starts[0][name], 10 * starts[-1][name])}
    begin = trial.effect({"softness": 0.0, **starts[1]})
    further = (starts[0], *starts[2:])
    return replace(_of_a_gear(trial), effect=begin, bounds=bounds, starts=further)


def _coupled(trial: StartContext) -> Hypothesis | None:
    """Begin without a turn that one axis gives the next; a rigid gear cannot be turned along.

    Friction of both is not free: one law of two axes takes the place of several of one.
    """
    assert isinstance(trial.place, tuple)  # by its scope
    if trial.robot.axis_is_rigid[trial.place[1] - 1]:
        return None
    return Hypothesis(_neutral(trial).effect, ("share",))


def _axis_share(at: StartData, index: int) -> float:
    """Return the share of the residual error on an axis [1]."""
    logs = zip(*at.turning, strict=True)
    squares = [sum(float(log.residual @ log.residual) for log in axis) for axis in logs]
    return squares[index] / max(sum(squares), 1e-300)


# Limits that are looked at, as shares of the largest torque.
_LIMITS = np.geomspace(0.05, 0.98, 40)
# Share of the time that a law may command more, of positions that lag behind by it.
_BEYOND = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)


def _limit(trial: StartContext) -> Hypothesis:
    """Begin at the limit beyond which the torque explains most of the residual: a command makes up for what is cut."""
    return _limit_by(trial, -1.0)


def _limit_of_targets(trial: StartContext) -> Hypothesis:
    """Begin likewise where positions are compared: what is cut they lack, and commands wind up beyond it."""
    found = _limit_by(trial, 1.0)
    levels = np.quantile(np.abs(np.concatenate(trial.torque())), 1 - np.array(_BEYOND))
    return replace(found, starts=tuple({"limit_nm": float(level)} for level in levels))


def _limit_by(trial: StartContext, sign: float) -> Hypothesis:
    """Begin at the limit beyond which the torque, times ``sign``, goes with most of the residual."""
    torques = trial.torque()
    limits = _LIMITS * max(float(np.abs(torque).max()) for torque in torques)
    along, power = np.zeros(len(limits)), np.zeros(len(limits))
    for axes, torque in zip(trial.at.turning, torques, strict=True):
        log = axes[trial.index]
        n = len(log.residual)
        every = len(torque) // n
        beyond = np.sign(torque) * np.maximum(np.abs(torque) - limits[:, None], 0.0)
        beyond = beyond[:, : n * every].reshape(len(limits), n, every).mean(axis=2)
        response = trial.at.response(trial.info.name, trial.index, log.frequency_hz)
        seen = passed(beyond, response)
        along += seen @ log.residual
        power += np.sum(seen**2, axis=1)
    gain = np.maximum(sign * along, 0.0) ** 2 / np.maximum(power, 1e-300)
    return Hypothesis(trial.effect({"limit_nm": float(limits[np.argmax(gain)])}), ("limit_nm",))


def _lifts(robot: Robot) -> bool:
    """Whether gravity turns the first joint."""
    lever = np.cross(robot.joints[0].axis, robot.gravity_m_s2)
    return not robot.joints[0].prismatic and bool(np.linalg.norm(lever) > _SMALL_SHARE)


def _point_mass(trial: StartContext) -> Hypothesis | None:
    """Begin at the centre of mass of the last link that has one, or beside it.

    There a mass is one of the link, which the re-fit may have all of; beside it, it is not. Of a single
    axis that lifts it, it is as good as a link that is heavier or has another centre, which is said where
    it leads; one that does not lift it shows no more than an inertia.
    """
    joints = trial.robot.joints
    links = [j.link for j in joints if j.link is not None]
    if not links or (len(joints) == 1 and not _lifts(trial.robot)):
        return None
    x, y, z = links[-1].com_m
    reach = sum(float(np.linalg.norm(j.origin_m)) for j in joints) or 1.0
    centre = {"x_m": float(x), "y_m": float(y), "z_m": float(z)}
    # Tools reach about as far as the last links do.
    spread = 0.3 * reach
    # What is taken off a link leaves some of it, re-fitted or not.
    top = next(p.upper for p in trial.info.parameters if p.name == "mass_kg")
    beside = [
        {**centre, name: value + side * 0.5 * spread}
        for name, value in centre.items()
        for side in (-1.0, 1.0)
    ]
    return Hypothesis(
        trial.effect({"mass_kg": 0.0, **centre}),
        ("mass_kg", "x_m", "y_m", "z_m"),
        {name: (value, spread) for name, value in centre.items()},
        {"mass_kg": (-0.8 * float(links[-1].mass_kg), top)},
        tuple(beside),
    )


def _pulling_back(trial: StartContext) -> Hypothesis:
    """Begin at the neutral value; what pushes on is no cable, but gravity that is not balanced."""
    stiffness = trial.info.parameters[0]
    return replace(_neutral(trial), bounds={stiffness.name: (0.0, stiffness.upper)})


def _balancer(trial: StartContext) -> Hypothesis | None:
    """Begin at the neutral values; what slides has no angle that gravity turns with."""
    return None if trial.robot.axis_is_prismatic[trial.index] else _neutral(trial)


# Over less of a wave it is as good as a constant and a slope, and how many waves there may be; how far
# a fit goes from the one that is found, and with how much of its wave it begins.
_LEAST_TURN_RAD = 1.5
_MOST_TURNS_RAD = 15.0
_NEAR = 3.0
_BEGUN = 0.3


def _uneven(trial: StartContext) -> Hypothesis | None:
    """Begin as a law, with the wave of the residual's dry friction over the motor angle, where there is one."""
    if (
        trial.robot.axis_is_prismatic[trial.index]
        or _axis_share(trial.at, trial.index) <= _SMALL_SHARE
    ):
        return None
    logs, responses = trial.turned()
    travel = max(float(np.ptp(log.angle_rad)) for log in logs)
    if travel == 0:
        return None
    ends = (_LEAST_TURN_RAD / travel, _MOST_TURNS_RAD / travel)
    wave = wave_of_friction(logs, responses, *ends, below_hz=rigid_below_hz(trial.robot))
    if wave is None:
        return None
    order, cosine, sine = wave
    # An order has no slope where its wave is zero; from the middle a fit finds either side of the gear.
    begin = _law(smoothing_rad_s=_SMOOTHING)(trial).at(
        {
            "order": order,
            "cosine_nm": _BEGUN * cosine,
            "sine_nm": _BEGUN * sine,
            BEHIND_GEAR: 0.5,
        }
    )
    bounds = {**begin.bounds, "order": (max(order / _NEAR, 0.5 * ends[0]), order * _NEAR)}
    return replace(begin, bounds=bounds, starts=())


# From the slowest swing that ten seconds show to those that gears have themselves; a swing is found
# from as far away as its resonance is wide.
_SWINGS_HZ = tuple(float(f) for f in np.geomspace(3.0, 40.0, 12))
_WIDTH = 0.1


def _swing(trial: StartContext) -> Hypothesis:
    """Begin at several frequencies, where there is much to explain."""
    begin = _neutral(trial)
    worth_it = _axis_share(trial.at, trial.index) > _SMALL_SHARE
    starts = tuple({"frequency_hz": f} for f in _SWINGS_HZ) if worth_it else ()
    return replace(
        begin.at({"damping": _WIDTH}),
        priors={"damping": (_WIDTH, _WIDTH)},
        bounds={"frequency_hz": (0.5 * _SWINGS_HZ[0], 2 * _SWINGS_HZ[-1])},
        starts=starts,
    )


# Bases of arms rock from here to there; stiffer ones show less.
_ROCKS_HZ = (6.0, 12.0, 24.0)


def _rocking(trial: StartContext) -> Hypothesis | None:
    """Begin with a base that swings at several frequencies, where there is much to explain."""
    share = max(_axis_share(trial.at, i) for i in range(trial.robot.n_axes))
    names = [p.name for p in trial.info.parameters if p.role == "amplitude"]
    inertia = _inertia_about_base(trial.robot)
    if share <= _SMALL_SHARE or not np.all(inertia > 0):
        return None

    def swinging(frequency_hz: float) -> dict[str, float]:
        compliance = 1.0 / (inertia * (2 * np.pi * frequency_hz) ** 2)
        return dict(zip(names, compliance.tolist(), strict=True))

    # Stiffer, nothing shows and the spring is hard to integrate; softer, the arm would fall over.
    bounds = {n: (0.02 * c, 100 * c) for n, c in swinging(_ROCKS_HZ[-1]).items()}
    free = tuple(p.name for p in trial.info.parameters)
    begin = Hypothesis(trial.effect(swinging(_ROCKS_HZ[-1])), free, bounds=bounds)
    return replace(begin, starts=tuple(swinging(f) for f in _ROCKS_HZ[:-1]))


def _inertia_about_base(robot: Robot) -> Array:
    """Return the inertia about x and y of the base (2,) [kg m^2], links as points."""
    q = np.zeros(robot.n_joints)
    q[robot.axis_joints] = robot.operating_point
    out = np.zeros(2)
    for i, joint in enumerate(robot.joints):
        if joint.link is not None:
            rotation, position = robot.pose(q, i)
            x, y, z = position + rotation @ joint.link.com_m
            out += joint.link.mass_kg * np.array([y * y + z * z, x * x + z * z])
    return out


# Of the longest log: over less it is viscous friction, over more it does not show.
_WARM = (0.25, 0.5, 10.0)


def _warming(trial: StartContext) -> Hypothesis:
    """Begin without, half a log to warm up."""
    longest = max(float(log.time_s[-1]) for log in trial.logs)
    least, middle, most = (share * longest for share in _WARM)
    begin = _neutral(trial).at({"time_constant_s": middle})
    return replace(begin, bounds={"time_constant_s": (least, most)})


# Farther off, a link is not mistaken but another one, and something else is the likelier cause.
_DOUBLE = (-0.6, 1.0)
_DISTANCE_M = 0.5


def _link_share(trial: StartContext) -> Hypothesis:
    """Begin at the neutral value; a link is at most twice what it was modelled as."""
    return replace(_neutral(trial), bounds={p.name: _DOUBLE for p in trial.info.parameters})


def _link_place(trial: StartContext) -> Hypothesis:
    """Begin at the neutral values, and stay on the link."""
    reach = (-_DISTANCE_M, _DISTANCE_M)
    return replace(_neutral(trial), bounds={p.name: reach for p in trial.info.parameters})


def _shown_by_logs(_trial: StartContext) -> None:
    """Offer nothing: controllers, clocks and steps are algebra of the logs, no fit of a machine."""


def _as_its_twin(_trial: StartContext) -> None:
    """Offer nothing: an effect that is tried gives the very same logs."""


def _read_late(trial: StartContext) -> Hypothesis | None:
    """Begin with none; of an axis alone a delay of the drive gives the very same logs."""
    return _neutral(trial) if trial.robot.n_axes > 1 else None


STARTS: Mapping[str, Callable[[StartContext], Hypothesis | None]] = {
    "viscous_friction": _neutral,
    "coulomb_friction": _law(smoothing_rad_s=_SMOOTHING),
    "asymmetric_friction": _law(smoothing_rad_s=_SMOOTHING),
    "stribeck_friction": _stribeck,
    "presliding_friction": _presliding,
    "backlash": _play,
    "nonlinear_stiffness": _hardening,
    "joint_stiffness": _of_a_gear,
    "torque_ripple": _waves,
    "resolver_ripple": _waves,
    "input_delay": _neutral,
    "actuator_bandwidth": _neutral,
    "torque_constant": _neutral,
    "torque_offset": _neutral,
    "payload": _point_mass,
    "motor_inertia": _neutral,
    "joint_damping": _neutral,
    "quadratic_drag": _neutral,
    "load_dependent_friction": _law(smoothing_rad_s=_SMOOTHING),
    "gravity_compensation": _balancer,
    "cable_stiffness": _pulling_back,
    "transmission_error": _gear_waves,
    "torque_saturation": _limit,
    "gear_hysteresis": _slip,
    "torque_deadband": _neutral,
    "base_tilt": _neutral,
    "position_dependent_friction": _uneven,
    "extra_mode": _swing,
    "controller_gain": _shown_by_logs,
    "velocity_filter": _shown_by_logs,
    "link_mass": _link_share,
    "link_com": _link_place,
    "link_inertia": _link_share,
    "base_compliance": _rocking,
    "friction_warmup": _warming,
    "piecewise_stiffness": _knee,
    "joint_zero_offset": _neutral,
    "torque_sensor_gain": _shown_by_logs,
    "sensor_delay": _read_late,
    "torque_sensor_offset": _as_its_twin,
    "feedforward_missing": _shown_by_logs,
    "current_loop": _neutral,
    "link_geometry": _before_the_last,
    "lost_motion": _soft,
    "encoder_eccentricity": _neutral,
    "power_supply_sag": _neutral,
    "axis_coupling": _coupled,
    "clock_drift": _shown_by_logs,
    "position_quantization": _shown_by_logs,
    "rotor_inertia": _neutral,
}
"""By effect."""

# Where positions alone are compared, nothing shows at what speed friction turns round; a law that turns
# within a sample chatters.
_TURNS_SLOWLY = 0.05


def _gain_of_position(trial: StartContext) -> Hypothesis:
    """Begin at the neutral values; another gain of speed is viscous friction, which is tried as such.

    But of a cascade with an integral, whose gains all act on one error: without one, another gain of speed is
    a torque constant.
    """
    found, gains = _neutral(trial), trial.robot.controller_gains
    proportional, _, position = found.free
    if "kv" not in gains:
        return replace(found, free=(proportional,))
    if gains["ki"][trial.index] > 0:
        return found
    return replace(found, free=(position,))


TARGET_STARTS: Mapping[str, Callable[[StartContext], Hypothesis | None]] = {
    "coulomb_friction": _law(smoothing_rad_s=_TURNS_SLOWLY),
    "asymmetric_friction": _law(smoothing_rad_s=_TURNS_SLOWLY),
    "load_dependent_friction": _law(smoothing_rad_s=_TURNS_SLOWLY),
    # Nor whether it yields before it slips.
    "presliding_friction": lambda _trial: None,
    # No logged torque tells a controller: a fit has to.
    "controller_gain": _gain_of_position,
    "torque_saturation": _limit_of_targets,
}
"""Of those that begin otherwise where positions are compared under the same targets."""
