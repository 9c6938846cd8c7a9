"""The candidates of a diagnosis: every effect on every axis, with start values from the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info, effect_table
from axisight.gap.model import Evidence, FreeEffect
from axisight.gap.orders import strongest_orders
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Effects that an inverse-dynamics prediction cannot contain.
_DYNAMIC = {"transmission", "sensor"}
_TIMING = {"input_delay", "actuator_bandwidth"}
# Its bristles are stiff at plausible sizes; the fits integrate explicitly.
_NOT_YET = {"presliding_friction"}
_HARMONIC = ("torque_ripple", "resolver_ripple")
_N_ORDERS = 3


@dataclass(frozen=True)
class Situation:
    """What start values are taken from: logs and baseline residual torque on a common grid.

    ``residual[log][axis]`` weighted residual torque, ``angle`` and ``speed``
    motor side at the same samples, ``bandwidth_hz`` below which the residual
    torque follows a torque on the motor.
    """

    residual: list[list[Array]]
    angle: list[list[Array]]
    speed: list[list[Array]]
    bandwidth_hz: float


def situation(
    robot: Robot, logs: Sequence[Log], baseline: Evidence, decimation: int, bandwidth_hz: float
) -> Situation:
    """Return residual, angle and speed by log and axis at the decimated rate."""
    residual: list[list[Array]] = []
    angle: list[list[Array]] = []
    speed: list[list[Array]] = []
    for i, log in enumerate(logs):
        rows: list[Array] = []
        angles: list[Array] = []
        speeds: list[Array] = []
        for axis in range(robot.n_axes):
            mine = (baseline.log == i) & (baseline.axis == axis)
            first = int(baseline.start[mine].min())
            count = int(baseline.size[mine].sum())
            rows.append(baseline.residual[first : first + count])
            position = log.position_rad[:, axis]
            rate = np.gradient(position, log.sample_time_s)
            # A short running mean takes the quantization and noise off the speed.
            rate = np.convolve(rate, np.ones(9) / 9, mode="same")
            angles.append(position[::decimation][:count])
            speeds.append(rate[::decimation][:count])
        residual.append(rows)
        angle.append(angles)
        speed.append(speeds)
    return Situation(residual, angle, speed, bandwidth_hz)


def all_candidates(
    robot: Robot, logs: Sequence[Log], at: Situation, *, inverse_dynamics: bool = False
) -> list[FreeEffect]:
    """Return one candidate per effect and axis (or arm) that can act on this robot."""
    out = []
    rigid = robot.axis_is_rigid
    for info in effect_table().values():
        if info.name in _NOT_YET:
            continue
        impossible = info.acts in _DYNAMIC or info.name in _TIMING
        if inverse_dynamics and impossible and info.name != "motor_inertia":
            continue
        if info.scope == "arm":
            if _has_gravity(robot):
                out.append(_payload(robot))
            continue
        for axis in robot.axis_numbers():
            if info.acts == "transmission" and rigid[axis - 1]:
                continue
            candidate = _axis_candidate(robot, logs, at, info.name, axis)
            if candidate is not None:
                out.append(candidate)
    own = {effect.label: effect for effect in robot.effects if effect.acts}
    return [_from(own[c.effect.label], c) if c.effect.label in own else c for c in out]


def _from(own: Effect, candidate: FreeEffect) -> FreeEffect:
    """Return the candidate that begins where the simulator has the same effect already."""
    values = dict(
        zip((p.name for p in effect_info(own.name).parameters), own.values(), strict=True)
    )
    bounds = {
        name: (min(low, values[name]), max(high, values[name]))
        for name, (low, high) in candidate.bounds.items()
    }
    free = candidate.free
    if own.name in _HARMONIC:
        unit = "nm" if own.name == "torque_ripple" else "rad"
        parts = {k: (f"cosine_{k}_{unit}", f"sine_{k}_{unit}") for k in range(1, _N_ORDERS + 1)}
        # A place without amplitude is empty, whatever its order.
        mine = {k: values[f"order_{k}"] for k in parts if any(values[p] for p in parts[k])}
        given = candidate.effect.parameters or {}
        found = [given[f"order_{k}"] for k in parts]
        new = iter(order for order in found if order and order not in mine.values())
        for k in parts:
            values[f"order_{k}"] = mine.get(k) or next(new, 0.0)
        free = tuple(p for k in parts if values[f"order_{k}"] for p in parts[k])
    return replace(candidate, effect=Effect(own.name, own.axis, values), bounds=bounds, free=free)


def _has_gravity(robot: Robot) -> bool:
    """Whether a mass on the last link shows at all: more than a single axis."""
    return robot.n_joints > 1


def _axis_candidate(
    robot: Robot, logs: Sequence[Log], at: Situation, name: str, axis: int
) -> FreeEffect | None:
    if name in _HARMONIC:
        return _ripple(at, name, axis)
    if name == "torque_saturation":
        return _saturation(logs, axis)
    if name in ("motor_inertia", "joint_damping") and not _own(robot, name, axis):
        return None
    if name == "transmission_error":
        return FreeEffect(
            Effect(name, axis, {"order": 2.0, "cosine_rad": 0.0, "sine_rad": 0.0}),
            ("cosine_rad", "sine_rad"),
        )
    if name == "backlash":
        return _backlash(robot, logs, at, axis)
    parameters = effect_info(name).parameters
    start = {p.name: p.neutral for p in parameters}
    bounds = {}
    # Speeds that shape a friction law are shares of the speeds seen.
    top = max(float(np.abs(v[axis - 1]).max()) for v in at.speed) or 1.0
    for p, share in (("smoothing_rad_s", 0.003), ("stribeck_speed_rad_s", 0.1)):
        if p in start:
            start[p] = share * top
            bounds[p] = (0.1 * share * top, 10 * share * top)
    return FreeEffect(Effect(name, axis, start), tuple(p.name for p in parameters), bounds=bounds)


def _backlash(robot: Robot, logs: Sequence[Log], at: Situation, axis: int) -> FreeEffect:
    """Start at several widths, as shares of the deflection the largest torque gives."""
    joint = robot.axis_names[axis - 1]
    stiffness = robot.parameters()[f"{joint}.stiffness"]
    ratio = abs(float(robot.gear_ratio[axis - 1]))
    spread = max(float(np.std(log.torque_nm[:, axis - 1])) for log in logs)
    deflection = spread / ratio / stiffness
    # The valley around the true width is narrow: impacts must stay in phase.
    shares = np.geomspace(0.04, 0.8, 18) if _axis_share(at, axis) > _SMALL_SHARE else ()
    starts = tuple({"half_width_rad": float(s * deflection)} for s in shares)
    return FreeEffect(
        Effect("backlash", axis, {"half_width_rad": 0.0}), ("half_width_rad",), starts=starts
    )


# An axis with less of the error than this is not worth many starts.
_SMALL_SHARE = 0.1


def _axis_share(at: Situation, axis: int) -> float:
    """Return the share of the residual error on an axis [1]."""
    squares = [sum(float(row @ row) for row in rows) for rows in zip(*at.residual, strict=True)]
    return squares[axis - 1] / max(sum(squares), 1e-300)


def _own(robot: Robot, effect: str, axis: int) -> float:
    """Return the simulator's value of what a relative effect changes."""
    joint = robot.axis_names[axis - 1]
    quantity = {"motor_inertia": "motor_inertia", "joint_damping": "damping"}[effect]
    return robot.parameters()[f"{joint}.{quantity}"]


def _ripple(at: Situation, name: str, axis: int) -> FreeEffect | None:
    i = axis - 1
    orders = strongest_orders(
        [r[i] for r in at.residual],
        [a[i] for a in at.angle],
        [v[i] for v in at.speed],
        count=_N_ORDERS,
        bandwidth_hz=at.bandwidth_hz,
        speed_power=2 if name == "resolver_ripple" else 0,
    )
    if not orders:
        return None
    unit = "nm" if name == "torque_ripple" else "rad"
    start: dict[str, float] = {}
    free: list[str] = []
    for k, order in enumerate(orders, start=1):
        start[f"order_{k}"] = float(order)
        free += [f"cosine_{k}_{unit}", f"sine_{k}_{unit}"]
    # Terms without an order are switched off.
    for k in range(len(orders) + 1, 5):
        start[f"order_{k}" if (name == "resolver_ripple" or k < 4) else "order_u"] = 0.0
    start.update(dict.fromkeys(free, 0.0))
    return FreeEffect(Effect(name, axis, start), tuple(free))


def _saturation(logs: Sequence[Log], axis: int) -> FreeEffect:
    largest = max(float(np.abs(log.torque_nm[:, axis - 1]).max()) for log in logs)
    typical = np.median([np.abs(log.torque_nm[:, axis - 1]).max() for log in logs])
    start = 0.9 * min(largest, float(typical))
    return FreeEffect(Effect("torque_saturation", axis, {"limit_nm": start}), ("limit_nm",))


def _payload(robot: Robot) -> FreeEffect:
    """Return a point mass that starts at the centre of mass of the last link that has one."""
    joints = robot.joints
    x, y, z = next(j.link.com_m for j in reversed(joints) if j.link is not None)
    reach = sum(float(np.linalg.norm(j.origin_m)) for j in joints) or 1.0
    centre = {"x_m": float(x), "y_m": float(y), "z_m": float(z)}
    # Tools reach about as far as the last links do.
    spread = 0.3 * reach
    return FreeEffect(
        Effect("payload", None, {"mass_kg": 0.0, **centre}),
        ("mass_kg", "x_m", "y_m", "z_m"),
        {name: (value, spread) for name, value in centre.items()},
    )
