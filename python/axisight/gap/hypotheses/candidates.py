"""Lists the hypotheses of a diagnosis: every effect on every axis, with start values from the data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, EffectInfo, effect_info, effect_table
from axisight.effects.stated import BEHIND_GEAR, BRISTLES
from axisight.gap.controller.feedback import inertia_of_motors, rotors
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.hypotheses.ripple_orders import Turning, turning
from axisight.gap.hypotheses.start_context import Place, Response, StartContext, StartData
from axisight.gap.hypotheses.start_values import STARTS, TARGET_STARTS
from axisight.logs import Log
from axisight.robot import Robot
from axisight.robot.branches import neighbouring_axes

Array = NDArray[np.float64]


def situation(
    logs: Sequence[Log],
    model: FittedModel,
    decimation: int,
    response: Response,
    enough: Array,
    before: Sequence[Sequence[Turning]] = (),
) -> StartData:
    """Return the weighted residual of a model and the motion of the motors, by log and axis.

    ``response``: see `StartData`; ``enough`` (n_axes,): mean square of the residual up to which no cause is worth
    naming. ``before``: the result for another model of the same logs, whose motion is reused.
    """

    def one(i: int, log: Log, axis: int) -> Turning:
        mine = (model.log == i) & (model.axis == axis)
        first = int(model.start[mine].min())
        part = slice(first, first + int(model.size[mine].sum()))
        residual, bent = model.residual[part], columns[:, part]
        if before:
            return before[i][axis].leaving(residual, bent)
        position = log.position_rad[:, axis]
        speed = np.gradient(position, log.sample_time_s)
        # A running mean over nine samples removes quantization and noise from the speed.
        speed = np.convolve(speed, np.ones(9) / 9, mode="same")
        return turning(residual, position, speed, log.sample_time_s, decimation, bent)

    own = [model.columns[None, name] for place, name in model.at_bound if place is None]
    columns = np.array([c.values for c in own]).reshape(len(own), len(model.residual))
    axes = range(logs[0].n_axes)
    turned = [[one(i, log, axis) for axis in axes] for i, log in enumerate(logs)]
    return StartData(turned, response, enough)


def all_candidates(
    robot: Robot,
    logs: Sequence[Log],
    at: StartData,
    *,
    inverse_dynamics: bool = False,
    by_targets: bool = False,
    threads: int = 1,
) -> list[Hypothesis]:
    """Return one candidate for each effect and each axis or pair of axes where it can act and a gap is left.

    An effect always shows on its own axis, so an axis without a gap needs no candidates. ``inverse_dynamics``: only
    effects that show in computed torque; ``by_targets``: start values for compared positions.
    """
    trials = [
        StartContext(info, place, robot, logs, at)
        for info in effect_table().values()
        if not inverse_dynamics or _in_torque(info)
        for place in _places(robot, info)
        if place is None or any(at.is_left(axis - 1) for axis in np.atleast_1d(place))
    ]
    sides = robot.axis_numbers() if inverse_dynamics else one_sided(robot)
    with ThreadPoolExecutor(threads) as pool:
        starts = {**STARTS, **TARGET_STARTS} if by_targets else STARTS
        found = map(_allowed, pool.map(lambda t: starts[t.info.name](t), trials))
        out = [on_the_motor(c) if c.effect.axis in sides else c for c in found if c is not None]
    own = {effect.label: effect for effect in robot.effects if effect.acts}
    return [_from(own[c.effect.label], c) if c.effect.label in own else c for c in out]


def _allowed(candidate: Hypothesis | None) -> Hypothesis | None:
    """Return a candidate without starts that the table of effects does not allow; None if no value is left.

    The speeds and travel of an axis that stands still give such values: its logs cannot show the effect.
    """
    if candidate is None or any(low > high for low, high in map(candidate.limits, candidate.free)):
        return None
    if not _in_table(candidate, candidate.effect.parameters or {}):
        return None
    starts = tuple(start for start in candidate.starts if _in_table(candidate, start))
    return replace(candidate, starts=starts)


def _in_table(candidate: Hypothesis, values: Mapping[str, float]) -> bool:
    """Whether values of a candidate's parameters lie between the bounds of the table of effects."""
    table = {p.name: (p.lower, p.upper) for p in effect_info(candidate.effect.name).parameters}
    return all(table[name][0] <= x <= table[name][1] for name, x in values.items())


# Smallest inertia of the arm at a motor, as a share of the rotor's, from which logs tell on which side of the gear
# friction acts.
_HEAVY = 0.2


def one_sided(robot: Robot) -> list[int]:
    """Return the axes (from 1) whose logs do not tell motor friction from friction behind the gear.

    These axes have a rigid gear or a light arm, which follows the motor. Friction behind the gear is not tried there:
    sharp friction on a small inertia is slow to integrate.
    """
    rotor = rotors(robot)
    felt = np.diag(inertia_of_motors(robot)) - rotor
    light = felt < _HEAVY * rotor
    return [
        axis for axis in robot.axis_numbers() if robot.axis_is_rigid[axis - 1] or light[axis - 1]
    ]


def on_the_motor(candidate: Hypothesis) -> Hypothesis:
    """Return a candidate with all its friction on the motor side, and no parameter to move it behind the gear."""
    given = dict(candidate.effect.parameters or {})
    if BEHIND_GEAR not in given:
        return candidate
    effect = replace(candidate.effect, parameters={**given, BEHIND_GEAR: 0.0})
    free = tuple(name for name in candidate.free if name != BEHIND_GEAR)
    starts = tuple(start for start in candidate.starts if BEHIND_GEAR not in start)
    return replace(candidate, effect=effect, free=free, starts=starts)


def _in_torque(info: EffectInfo) -> bool:
    """Whether an effect is tried in inverse dynamics.

    Left out are effects between axes, which act through an elastic gear, and bristle friction: gears are rigid there,
    and it equals another effect.
    """
    return info.inverse_dynamics and info.scope != "axes" and info.name != BRISTLES[0]


def _places(robot: Robot, info: EffectInfo) -> list[Place]:
    """Return the axes (from 1) or pairs of neighbouring axes on which an effect can act; (None,) for the whole arm."""
    if info.needs_chain and not robot.is_chain:
        return []
    if info.scope == "arm":
        return [None]
    if info.scope == "axes":
        return list(neighbouring_axes(robot))
    rigid = robot.axis_is_rigid
    return [
        axis
        for axis in robot.axis_numbers()
        if not (info.acts == "transmission" and rigid[axis - 1])
        and _has_what_changes(robot, info, axis)
    ]


def _has_what_changes(robot: Robot, info: EffectInfo, axis: int) -> bool:
    """Whether an axis has the link that an effect acts on, and the parameter that it scales or adds."""
    if info.acts == "arm" and robot.axis_parameter(axis, "mass") is None:
        return False
    if info.stands_for is None:
        return True
    quantity, change = info.stands_for
    name = robot.axis_parameter(axis, quantity)
    there = name is not None and robot.parameters()[name] != 0
    # If an effect scales the parameter, a second one that adds to it would be the same.
    shares = any(other.stands_for == (quantity, "relative") for other in effect_table().values())
    return there if change == "relative" else not (there and shares)


def _from(own: Effect, candidate: Hypothesis) -> Hypothesis:
    """Return the candidate with start values from the same effect that the simulator already has."""
    info = effect_info(own.name)
    values = dict(zip((p.name for p in info.parameters), own.values(), strict=True))
    stated = dict(values)
    bounds = {
        name: (min(low, values[name]), max(high, values[name]))
        for name, (low, high) in candidate.bounds.items()
    }
    free = candidate.free
    given = candidate.effect.parameters or {}
    # Numbered terms of a series, of which the candidate uses some.
    terms = [t for t in info.terms().values() if t[0] in given and len(info.terms()) > 1]
    if terms:
        free = _merged_terms(values, given, terms)
    return replace(
        candidate, effect=own.with_values(values), bounds=bounds, free=free, stated=stated
    )


def _merged_terms(
    values: dict[str, float], given: Mapping[str, float], terms: Sequence[tuple[str, str, str]]
) -> tuple[str, ...]:
    """Put orders from the data into the terms that the simulator leaves empty; return the free parameters."""
    # A term without amplitude is empty, whatever its order.
    mine = {order: values[order] for order, *waves in terms if any(values[w] for w in waves)}
    found = (given[order] for order, *_ in terms)
    new = iter(order for order in found if order and order not in mine.values())
    for order, *_ in terms:
        values[order] = mine.get(order) or next(new, 0.0)
    return tuple(wave for order, *waves in terms if values[order] for wave in waves)
