"""Start values, bounds and priors of effects from data: one table entry per effect.

An entry takes a :class:`StartContext` and returns a hypothesis, or None if the effect cannot be found in these data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.effects.stated import BEHIND_GEAR, PLAY
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.hypotheses.friction_starts import (
    SMOOTHING,
    TURNS_SLOWLY,
    by_direction,
    dry_law,
    presliding,
    stribeck,
)
from axisight.gap.hypotheses.friction_waves import wave_of_friction
from axisight.gap.hypotheses.ripple_orders import passed, strongest_orders
from axisight.gap.hypotheses.start_context import StartContext, StartData
from axisight.gap.signals.both_encoders import play_rad
from axisight.gap.signals.lowpass_cutoff import rigid_below_hz
from axisight.robot import Robot

Array = NDArray[np.float64]


def _neutral(trial: StartContext) -> Hypothesis:
    """Start at the neutral values with all parameters free."""
    parameters = trial.info.parameters
    values = {p.name: p.neutral for p in parameters}
    return Hypothesis(trial.effect(values), tuple(values))


def _not_below_none(trial: StartContext) -> Hypothesis:
    """Start at none, and take away no more than the simulator has: no friction is negative in total."""
    begin = _neutral(trial)
    return replace(begin, bounds=dict.fromkeys(begin.free, (-_own(trial), np.inf)))


def _own(trial: StartContext) -> float:
    """Return the value of the simulator's own parameter that the effect adds to; zero without one."""
    adds_to, axis = trial.info.stands_for, trial.index + 1
    name = None if adds_to is None else trial.robot.axis_parameter(axis, adds_to[0])
    return 0.0 if name is None else trial.robot.parameters()[name]


def _not_last_link(trial: StartContext) -> Hypothesis | None:
    """Start at the neutral values; None for the last axis, whose link carries no further axis."""
    return _neutral(trial) if trial.index + 1 < trial.robot.n_axes else None


# Smallest number of waves over the travel of an axis, and of a slide; a longer wave could have any shape.
_LEAST_WAVES, _SLIDE_WAVES = 1.0, 2.0


def _waves(trial: StartContext) -> Hypothesis | None:
    """Start with the strongest orders of the residual over the motor angle; None without any.

    A short travel hardly tells neighbouring orders apart, so that the first one may be any of them.
    """
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
    first, *_ = next(iter(trial.info.terms().values()))
    starts = tuple({first: float(n)} for n in _neighbours(trial, orders))
    return Hypothesis(trial.effect(values | dict.fromkeys(free, 0.0)), tuple(free), starts=starts)


def _neighbours(trial: StartContext, orders: Sequence[int]) -> list[int]:
    """Return the orders beside the first one, if they are less than a wave over the travel apart from it."""
    turns = max(float(np.ptp(log.angle_rad)) for log in trial.turned()[0]) / (2 * np.pi)
    beside = (orders[0] - 1, orders[0] + 1) if turns < 1.0 else ()
    return [n for n in beside if n * turns >= _LEAST_WAVES and n not in orders]


def _orders(trial: StartContext, count: int) -> list[int]:
    """Return the strongest orders of the residual over the motor angle, given the response to the effect."""
    logs, responses = trial.turned()
    least = _SLIDE_WAVES if trial.robot.axis_is_prismatic[trial.index] else _LEAST_WAVES
    return strongest_orders(logs, responses, count=count, least_waves=least)


# Order of a harmonic drive: two waves per motor turn.
_TWICE = 2


def _gear_waves(trial: StartContext) -> Hypothesis:
    """Start with the two strongest orders of the residual over the motor angle, else with two waves per motor turn."""
    waves = tuple(p.name for p in trial.info.parameters if p.role == "amplitude")
    first, *others = _orders(trial, 2) or [_TWICE]
    values = {"order": float(first), "returned": 0.5, **dict.fromkeys(waves, 0.0)}
    values["second_ratio"] = others[0] / first if others else float(_TWICE)
    # A gear conserves power or passes torque at the nominal ratio; the start is midway.
    return Hypothesis(trial.effect(values), (*waves, "returned"), {"returned": (0.5, 0.5)})


# Share of the whole error up to which an axis gets no further start values.
_SMALL_SHARE = 0.1


# Smallest deflection for start values [rad]. Searches begin at a tenth of it, ten times the smallest value that effects
# accept.
_LEAST_DEFLECTION_RAD = 1e-4
# Smallest deflection for backlash [rad], which may belong to a much stiffer gear; almost zero.
_HARDLY_BENT_RAD = 1e-6


def _stiffness(trial: StartContext) -> float:
    robot = trial.robot
    return robot.parameters()[f"{robot.axis_names[trial.index]}.stiffness"]


def _deflection_rad(trial: StartContext, size: Callable[[Array], Any] = np.std) -> float:
    """Return the typical deflection of the gear [rad], under the torque of the log that moves it most.

    ``size``: measure of a torque series. At least the smallest deflection for start values.
    """
    return max(_bent_rad(trial, size), _LEAST_DEFLECTION_RAD)


def _bent_rad(trial: StartContext, size: Callable[[Array], Any] = np.std) -> float:
    """Return the same deflection [rad] with a much smaller lower limit."""
    ratio = abs(float(trial.robot.gear_ratio[trial.index]))
    most = max(float(size(torque)) for torque in trial.torque())
    return max(most / ratio / _stiffness(trial), _HARDLY_BENT_RAD)


# Quantiles of the torque between which a gear law is fitted; rarer torques say little about it.
_HARDLY_EVER = (0.005, 0.995)


def _of_a_gear(trial: StartContext) -> Hypothesis:
    """Start at the neutral values, with the range of deflections in which the gear works."""
    torque = np.concatenate(trial.torque()) / float(trial.robot.gear_ratio[trial.index])
    low, high = np.quantile(torque / _stiffness(trial), _HARDLY_EVER)
    return replace(_neutral(trial), deflections_rad=(float(low), float(high)))


# Largest half-width of the backlash of an industrial gear [rad]: 3 minutes of arc.
_WIDEST_RAD = 9e-4
# Ratio of neighbouring start widths. The minimum around the true width is narrow, because impacts must stay in phase.
_WIDER = 1.24


def _play(trial: StartContext) -> Hypothesis:
    """Start at several half-widths of the backlash; at none on an axis with a small share of the error.

    From 4 % of the deflection under the torque's standard deviation to 80 % of it, or on a rotating axis to the
    largest half-width of industrial gears. Some starts have teeth that rebound, some teeth that grease stops. The
    damping in the gap is fitted later; see `screening.restart_gear_law`. Where encoders on motor and joint show wider
    play, it starts at that width, with the damping free.
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
    if (seen := play_rad(trial.logs, trial.robot, i)) > widest:
        near = {"half_width_rad": (0.5 * seen, 2.0 * seen)}
        slowed = tuple({"half_width_rad": seen, PLAY[1]: s} for s in (1.0, 0.1, 0.01))
        return replace(begin, free=("half_width_rad", PLAY[1]), bounds=near, starts=slowed)
    rebounding = [{"half_width_rad": float(w), PLAY[1]: 0.0} for w in widths]
    stopped = [{"half_width_rad": float(w), PLAY[1]: 1.0} for w in widths[::2]]
    return replace(begin, starts=(*rebounding, *stopped))


# Stiffness of the cubic spring at the typical deflection, in linear stiffnesses: far enough from zero for a step.
_HARDER = (1.0, 3.0, 10.0, 30.0)


def _with_weight(torque: Array) -> float:
    """Return the rms of a torque: its mean bends a spring, too."""
    return float(np.sqrt(np.mean(torque**2)))


def _hardening(trial: StartContext) -> Hypothesis:
    """Start without a cubic spring, or where it is most of the stiffness."""
    begin = _of_a_gear(trial)
    if _axis_share(trial.at, trial.index) <= _SMALL_SHARE:
        return begin
    unit = _stiffness(trial) / _deflection_rad(trial, _with_weight) ** 2
    return replace(begin, starts=tuple({"cubic_nm_rad3": share * unit} for share in _HARDER))


# Deflection at which slipping begins, as shares of the typical deflection: far below it equals dry friction, far above
# a stiffer spring.
_SLIPS = (0.1, 0.4, 1.6)


def _slip(trial: StartContext) -> Hypothesis:
    """Start at several deflections at which the gear slips."""
    name, deflection = "deflection_rad", _deflection_rad(trial)
    less, first, *more = ({name: share * deflection} for share in _SLIPS)
    bounds = {name: (0.1 * _SLIPS[0] * deflection, 10 * _SLIPS[-1] * deflection)}
    begin = trial.effect(
        {"share": 0.0, "included": 0.5, "sharpness": 0.5, "strain_at_rest": 0.0, **first}
    )
    # The known stiffness comes from small motions, with the whole spring, or from large ones: either is possible.
    return Hypothesis(
        begin,
        ("share", name, "included", "sharpness", "strain_at_rest"),
        {"included": (0.5, 0.5), "sharpness": (0.5, 0.5), "strain_at_rest": (0.0, 0.5)},
        bounds,
        starts=(less, *more),
    )


# Deflection at which the stiffness changes, as shares of the typical deflection.
_KNEES = (0.1, 0.35, 1.2)


def _knee(trial: StartContext) -> Hypothesis:
    """Start at several deflections beyond which the stiffness differs."""
    name, deflection = "knee_rad", _deflection_rad(trial)
    starts = tuple({name: share * deflection} for share in _KNEES)
    bounds = {name: (0.3 * starts[0][name], 3 * starts[-1][name])}
    begin = trial.effect({"step": 0.0, "within": 0.0, **starts[1]})
    further = (starts[0], starts[2])
    return replace(_of_a_gear(trial), effect=begin, bounds=bounds, starts=further)


# Half-widths of a soft middle, as shares of the typical deflection: the gear must leave the middle to show it.
_MIDDLES = (0.05, 0.15, 0.45)
# Rounding of the edge: for teeth that come into contact one after another, and for teeth that do so at once.
_ROUNDED = (0.5, 0.05)


def _soft(trial: StartContext) -> Hypothesis:
    """Start at several widths of the middle, with the same stiffness there as outside."""
    name, deflection = "half_width_rad", _deflection_rad(trial)
    starts = [
        {name: share * deflection, "rounding": rounding}
        for rounding in _ROUNDED
        for share in _MIDDLES
    ]
    # The largest torques deflect a gear by several times the standard deviation.
    bounds = {name: (0.3 * starts[0][name], 10 * starts[-1][name])}
    begin = trial.effect({"softness": 0.0, **starts[1]})
    further = (starts[0], *starts[2:])
    return replace(_of_a_gear(trial), effect=begin, bounds=bounds, starts=further)


def _coupled(trial: StartContext) -> Hypothesis:
    """Start without coupling from one axis to the next; with rigid gears, both may share friction, in either sense.

    An elastic gear shows the turn that it gets. Its friction is not free: each axis has some of its own.
    """
    assert isinstance(trial.place, tuple)  # guaranteed by the scope of the effect
    begin = _neutral(trial).effect
    if not trial.robot.axis_is_rigid[trial.place[1] - 1]:
        return Hypothesis(begin, ("share",))
    shared = ("viscous_nm_s_rad", "coulomb_nm", "speed_ratio")
    return Hypothesis(begin, shared, starts=({"speed_ratio": -1.0},))


def _axis_share(at: StartData, index: int) -> float:
    """Return the share of one axis (from 0) in the whole squared residual [1]."""
    logs = zip(*at.turning, strict=True)
    squares = [sum(float(log.residual @ log.residual) for log in axis) for axis in logs]
    return squares[index] / max(sum(squares), 1e-300)


# Torque limits that are tried, as shares of the largest torque.
_LIMITS = np.geomspace(0.05, 0.98, 40)
# Share of the samples whose torque exceeds the limit, for start values where positions are compared: there the
# controller may command more than the motor gives.
_BEYOND = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)


def _limit(trial: StartContext) -> Hypothesis:
    """Start at the torque limit that explains most of the residual; commands compensate for the missing torque."""
    return _limit_by(trial, -1.0)


def _limit_of_targets(trial: StartContext) -> Hypothesis:
    """Start at a torque limit where positions are compared: the motion lacks the torque, and commands wind up."""
    found = _limit_by(trial, 1.0)
    levels = np.quantile(np.abs(np.concatenate(trial.torque())), 1 - np.array(_BEYOND))
    return replace(found, starts=tuple({"limit_nm": float(level)} for level in levels))


def _limit_by(trial: StartContext, sign: float) -> Hypothesis:
    """Start at the limit for which the torque beyond it, times ``sign``, explains most of the residual."""
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
    """Whether gravity acts about the first joint."""
    lever = np.cross(robot.joints[0].axis, robot.gravity_m_s2)
    return not robot.joints[0].prismatic and bool(np.linalg.norm(lever) > _SMALL_SHARE)


def _point_mass(trial: StartContext) -> Hypothesis | None:
    """Start at the centre of mass of the last link that has one, and at points beside it.

    A mass at the centre may equal a wrong link mass, which the re-fit can absorb; beside it, it cannot. With a single
    axis that lifts it, a payload equals a heavier link or another centre of mass; the diagnosis says so if it leads.
    A single axis that does not lift it shows only an inertia: then None.
    """
    joints = trial.robot.joints
    links = [j.link for j in joints if j.link is not None]
    if not links or (len(joints) == 1 and not _lifts(trial.robot)):
        return None
    x, y, z = links[-1].com_m
    reach = sum(float(np.linalg.norm(j.origin_m)) for j in joints) or 1.0
    centre = {"x_m": float(x), "y_m": float(y), "z_m": float(z)}
    # Prior spread of the place: tools reach about as far as the last links.
    spread = 0.3 * reach
    # A negative mass must leave part of the link.
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
    """Start at the neutral value. A negative stiffness would be unbalanced gravity, not a cable."""
    stiffness = trial.info.parameters[0]
    return replace(_neutral(trial), bounds={stiffness.name: (0.0, stiffness.upper)})


def _balancer(trial: StartContext) -> Hypothesis | None:
    """Start at the neutral values; None for a prismatic axis, whose angle does not turn gravity."""
    return None if trial.robot.axis_is_prismatic[trial.index] else _neutral(trial)


# Phase of the slowest and the fastest wave over the travel [rad]: less than 1.5 rad equals a constant and a slope. Then
# the factor by which a fit may change the order, and the share of the estimated wave at the start.
_LEAST_TURN_RAD = 1.5
_MOST_TURNS_RAD = 15.0
_NEAR = 3.0
_BEGUN = 0.3


def _uneven(trial: StartContext) -> Hypothesis | None:
    """Start as a friction law, with the strongest wave of dry friction over the motor angle; None without one."""
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
    # Without a wave, its order has no gradient. Half of the friction behind the gear lets a fit move it to either side.
    begin = dry_law(smoothing_rad_s=SMOOTHING)(trial).at(
        {
            "order": order,
            "cosine_nm": _BEGUN * cosine,
            "sine_nm": _BEGUN * sine,
            BEHIND_GEAR: 0.5,
        }
    )
    bounds = {**begin.bounds, "order": (max(order / _NEAR, 0.5 * ends[0]), order * _NEAR)}
    return replace(begin, bounds=bounds, starts=())


# Frequencies [Hz] from the slowest swing that ten seconds of data show to those of the gears themselves; and the
# damping ratio, since a fit finds a resonance from about its width away.
_SWINGS_HZ = tuple(float(f) for f in np.geomspace(3.0, 40.0, 12))
_WIDTH = 0.1


def _swing(trial: StartContext) -> Hypothesis:
    """Start at several frequencies, if the axis has a large share of the error."""
    begin = _neutral(trial)
    worth_it = _axis_share(trial.at, trial.index) > _SMALL_SHARE
    starts = tuple({"frequency_hz": f} for f in _SWINGS_HZ) if worth_it else ()
    return replace(
        begin.at({"damping": _WIDTH}),
        priors={"damping": (_WIDTH, _WIDTH)},
        bounds={"frequency_hz": (0.5 * _SWINGS_HZ[0], 2 * _SWINGS_HZ[-1])},
        starts=starts,
    )


# Frequencies of a rocking base [Hz]; stiffer bases hardly show.
_ROCKS_HZ = (6.0, 12.0, 24.0)


def _rocking(trial: StartContext) -> Hypothesis | None:
    """Start with a base that rocks at several frequencies, if an axis has a large share of the error."""
    share = max(_axis_share(trial.at, i) for i in range(trial.robot.n_axes))
    names = [p.name for p in trial.info.parameters if p.role == "amplitude"]
    inertia = _inertia_about_base(trial.robot)
    if share <= _SMALL_SHARE or not np.all(inertia > 0):
        return None

    def swinging(frequency_hz: float) -> dict[str, float]:
        compliance = 1.0 / (inertia * (2 * np.pi * frequency_hz) ** 2)
        return dict(zip(names, compliance.tolist(), strict=True))

    # A stiffer base shows nothing and is slow to integrate; on a softer one the arm would fall over.
    bounds = {n: (0.02 * c, 100 * c) for n, c in swinging(_ROCKS_HZ[-1]).items()}
    free = tuple(p.name for p in trial.info.parameters)
    begin = Hypothesis(trial.effect(swinging(_ROCKS_HZ[-1])), free, bounds=bounds)
    return replace(begin, starts=tuple(swinging(f) for f in _ROCKS_HZ[:-1]))


def _inertia_about_base(robot: Robot) -> Array:
    """Return the inertia about x and y of the base (2,) [kg m^2], with links as point masses."""
    q = np.zeros(robot.n_joints)
    q[robot.axis_joints] = robot.operating_point
    out = np.zeros(2)
    for i, joint in enumerate(robot.joints):
        if joint.link is not None:
            rotation, position = robot.pose(q, i)
            x, y, z = position + rotation @ joint.link.com_m
            out += joint.link.mass_kg * np.array([y * y + z * z, x * x + z * z])
    return out


# Smallest, first and largest time constant, as shares of the longest log: a shorter warm-up equals viscous friction, a
# longer one does not show.
_WARM = (0.25, 0.5, 10.0)


def _warming(trial: StartContext) -> Hypothesis:
    """Start without warm-up, with a time constant of half the longest log."""
    longest = max(float(log.time_s[-1]) for log in trial.logs)
    least, middle, most = (share * longest for share in _WARM)
    begin = _neutral(trial).at({"time_constant_s": middle})
    return replace(begin, bounds={"time_constant_s": (least, most)})


# Range of the relative change of a link's mass or inertia [1], and of the shift of its centre of mass [m]. A larger
# difference means another link, and another cause is more likely.
_OF_LINK = (-0.75, 1.0)
_DISTANCE_M = 0.5


def _link_share(trial: StartContext) -> Hypothesis:
    """Start at the neutral value; a link is at most twice as heavy as in the model, and at least a quarter."""
    return replace(_neutral(trial), bounds={p.name: _OF_LINK for p in trial.info.parameters})


def _link_place(trial: StartContext) -> Hypothesis:
    """Start at the neutral values, within 0.5 m."""
    reach = (-_DISTANCE_M, _DISTANCE_M)
    return replace(_neutral(trial), bounds={p.name: reach for p in trial.info.parameters})


def _shown_by_logs(_trial: StartContext) -> None:
    """Return None: controllers, clocks and sensor steps follow algebraically from the logs, without a fit."""


def _equal_to_another(_trial: StartContext) -> None:
    """Return None: another effect that is tried gives exactly the same logs."""


def _read_late(trial: StartContext) -> Hypothesis | None:
    """Start without delay; None for a single axis, where a delay of the drive gives exactly the same logs."""
    return _neutral(trial) if trial.robot.n_axes > 1 else None


STARTS: Mapping[str, Callable[[StartContext], Hypothesis | None]] = {
    "viscous_friction": _not_below_none,
    "coulomb_friction": dry_law(smoothing_rad_s=SMOOTHING),
    "asymmetric_friction": dry_law(smoothing_rad_s=SMOOTHING),
    "stribeck_friction": stribeck,
    "presliding_friction": presliding,
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
    "load_dependent_friction": dry_law(smoothing_rad_s=SMOOTHING),
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
    "torque_sensor_offset": _equal_to_another,
    "feedforward_missing": _shown_by_logs,
    "current_loop": _neutral,
    "link_geometry": _not_last_link,
    "lost_motion": _soft,
    "encoder_eccentricity": _neutral,
    "power_supply_sag": _neutral,
    "axis_coupling": _coupled,
    "clock_drift": _shown_by_logs,
    "position_quantization": _shown_by_logs,
    "rotor_inertia": _neutral,
    "viscous_asymmetry": by_direction,
}
"""Start of each effect, by its name."""


def _gain_of_position(trial: StartContext) -> Hypothesis:
    """Start at the neutral values, with those controller gains free that no other effect imitates.

    - Controller without ``kv``: the proportional gain. A wrong speed gain equals viscous friction.
    - Cascade without an integral: the position gain. A wrong speed gain equals a wrong torque constant.
    - Cascade with an integral: all gains, since all act on one error.
    """
    found, gains = _neutral(trial), trial.robot.controller_gains
    proportional, _, position = found.free
    if "kv" not in gains:
        return replace(found, free=(proportional,))
    if gains["ki"][trial.index] > 0:
        return found
    return replace(found, free=(position,))


TARGET_STARTS: Mapping[str, Callable[[StartContext], Hypothesis | None]] = {
    "coulomb_friction": dry_law(smoothing_rad_s=TURNS_SLOWLY),
    "asymmetric_friction": dry_law(smoothing_rad_s=TURNS_SLOWLY),
    "load_dependent_friction": dry_law(smoothing_rad_s=TURNS_SLOWLY),
    # Positions do not show pre-sliding.
    "presliding_friction": lambda _trial: None,
    # Without a logged torque, only a fit can show a wrong controller.
    "controller_gain": _gain_of_position,
    "torque_saturation": _limit_of_targets,
}
"""Start of each effect that differs where positions are compared under the same targets."""
