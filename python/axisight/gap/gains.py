"""Gains of a controller of targets with a tolerance: fitted as the simulator's own parameters.

They are no parameters of a robot. A fit has them as an effect that every model has, another gain of an
axis, and they go by names as parameters do: ``j1.kp``, their values relative changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from axisight.effects import Effect, effect_info
from axisight.effects.stated import OTHER_GAINS
from axisight.errors import InputError
from axisight.fitting import PRIOR_REACH, Parameter, robot_parameters
from axisight.gap.tolerances import GAINS, tolerance_of
from axisight.robot import Robot

# Parameters of the effect, in the order of the gains.
_CHANGES = dict(zip(GAINS, OTHER_GAINS[1], strict=True))


@dataclass(frozen=True)
class Gain:
    """A gain of an axis (from 1), by the parameter of the effect that changes it."""

    axis: int
    change: str


def gains_of(robot: Robot) -> dict[str, Gain]:
    """Return the gains of a controller of targets by name; none of others."""
    if robot.controller_kind != "pd_position":
        return {}
    return {
        f"{joint}.{gain}": Gain(axis, change)
        for axis, joint in zip(robot.axis_numbers(), robot.axis_names, strict=True)
        for gain, change in _CHANGES.items()
    }


def nominal_values(robot: Robot) -> dict[str, float]:
    """Return the values of a robot by name: of its parameters, and of gains, which have not changed."""
    return {**robot_parameters(robot), **dict.fromkeys(gains_of(robot), 0.0)}


def uncertain_gains(robot: Robot, tolerances: Mapping[str, float]) -> list[Parameter]:
    """Return the gains that have a tolerance, as what a fit moves.

    Raises InputError where the robot states other gains itself, in an effect.
    """
    limits = {p.name: (p.lower, p.upper) for p in effect_info(OTHER_GAINS[0]).parameters}
    out = []
    for name, gain in gains_of(robot).items():
        tolerance = tolerance_of(tolerances, name)
        if tolerance is None:
            continue
        lower, upper = limits[gain.change]
        reach = PRIOR_REACH * tolerance
        bounds = max(lower, -reach), min(upper, reach)
        out.append(Parameter(name, 0.0, *bounds, tolerance, prior=(0.0, tolerance)))
    stated = [e.label for e in robot.effects if e.name == OTHER_GAINS[0]]
    if out and stated:
        raise InputError(
            f"tolerances: expected gains without {stated[0]} where they have one ({out[0].name}), got both"
        )
    return out


def labels_of(robot: Robot, parameters: Sequence[Parameter]) -> frozenset[str]:
    """Return the effects that gains among parameters stand for."""
    known = gains_of(robot)
    axes = {known[p.name].axis for p in parameters if p.name in known}
    return frozenset(Effect(OTHER_GAINS[0], axis).label for axis in axes)


def with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with values by name, changes of gains among them."""
    plain, gains = split(robot, values)
    changed = robot.with_parameters(plain)
    return changed.with_effects([*robot.effects, *gains]) if gains else changed


def split(robot: Robot, values: Mapping[str, float]) -> tuple[dict[str, float], list[Effect]]:
    """Return the values of parameters, and the effects that changes of gains among them are."""
    known = gains_of(robot)
    plain = {name: value for name, value in values.items() if name not in known}
    return plain, _effects(known, values)


def as_effects(
    robot: Robot, effects: Sequence[Effect], parameters: Sequence[Parameter]
) -> tuple[list[Effect], list[Parameter]]:
    """Return what a fit moves as the core knows it: gains as parameters of effects behind the others."""
    known = gains_of(robot)
    mine = {p.name: p.initial for p in parameters if p.effect is None and p.name in known}
    gains = _effects(known, mine)
    places = {effect.axis: len(effects) + i for i, effect in enumerate(gains)}
    moved = [
        Parameter(
            known[p.name].change,
            p.initial,
            p.lower,
            p.upper,
            p.scale,
            effect=places[known[p.name].axis],
            prior=p.prior,
            frozen=p.frozen,
            nuisance=p.nuisance,
        )
        if p.name in mine and p.effect is None
        else p
        for p in parameters
    ]
    return [*effects, *gains], moved


def _effects(known: Mapping[str, Gain], values: Mapping[str, float]) -> list[Effect]:
    """Return the changes of gains among values, an effect for each axis that has one."""
    changes: dict[int, dict[str, float]] = {}
    for name, value in values.items():
        if name in known:
            changes.setdefault(known[name].axis, {})[known[name].change] = value
    return [Effect(OTHER_GAINS[0], axis, change) for axis, change in sorted(changes.items())]
