"""Torque constants that nobody knows, among the simulator's own parameters: the fit says what they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from axisight.effects import Effect
from axisight.effects.stated import TORQUE_CONSTANT, TORQUE_SENSOR
from axisight.fitting import Parameter, effect_parameter
from axisight.gap import gains
from axisight.robot import Robot

UNKNOWN = 1.0
"""Tolerance of a constant that nobody knows, relative [1]: one standard deviation is a factor of two."""
_QUANTITY, _ERROR = TORQUE_CONSTANT


def constant_name(robot: Robot, axis: int) -> str:
    """Return the name of the constant of an axis (from 1) among the simulator's own parameters."""
    return f"{robot.axis_names[axis - 1]}.{_QUANTITY}"


def own_constants(robot: Robot, axes: Sequence[int]) -> tuple[dict[str, Effect], list[Parameter]]:
    """Return constants that nobody knows, on ``axes`` (from 1), as effects by name and as parameters to fit."""
    stated = {e.label: e.values()[0] for e in robot.effects}
    effects, parameters = {}, []
    for axis in axes:
        name = constant_name(robot, axis)
        mean = stated.get(Effect(_QUANTITY, axis).label, 0.0)
        effects[name] = Effect(_QUANTITY, axis, {_ERROR: mean})
        one = effect_parameter([effects[name]], 0, _ERROR)
        parameters.append(replace(one, name=name, effect=None, prior=(mean, UNKNOWN * (1 + mean))))
    return effects, parameters


def for_core(
    effects: Sequence[Effect], parameters: Sequence[Parameter], constants: Mapping[str, Effect]
) -> tuple[list[Effect], list[Parameter]]:
    """Return effects and parameters with constants as what they are in the core: effects behind the others."""
    place = {name: len(effects) + k for k, name in enumerate(constants)}
    return [*effects, *constants.values()], [
        replace(p, name=_ERROR, effect=place[p.name]) if p.effect is None and p.name in place else p
        for p in parameters
    ]


def with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with its own parameters as they were fitted, constants and gains among them."""
    axes = {constant_name(robot, axis): axis for axis in robot.axis_numbers()}
    changed = gains.with_values(robot, {n: x for n, x in values.items() if n not in axes})
    found = [Effect(_QUANTITY, axes[n], {_ERROR: x}) for n, x in values.items() if n in axes]
    if not found:
        return changed
    effects = {effect.label: effect for effect in (*changed.effects, *found)}
    return changed.with_effects(list(effects.values()))


def absorbed(axes: Sequence[int]) -> set[str]:
    """Return the labels of effects that are no causes on ``axes`` (from 1): a constant nobody knows holds them."""
    return {Effect(name, axis).label for name in (_QUANTITY, TORQUE_SENSOR[0]) for axis in axes}


def nominal_error(robot: Robot, name: str) -> float | None:
    """Return the error that a robot states of a motor's gain [1], by the name of its constant; None of others."""
    for axis in robot.axis_numbers():
        if name == constant_name(robot, axis):
            label = Effect(_QUANTITY, axis).label
            return next((e.values()[0] for e in robot.effects if e.label == label), 0.0)
    return None
