"""Own parameters of the simulator that the core has as parameters of effects.

These are unknown torque constants, and gains of a controller of targets with a tolerance. A fit puts them into
effects of every model, after the effects that it tries. They have names like other parameters
(``j1.torque_constant``, ``j1.kp``); their values are relative changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from axisight.arguments import positive
from axisight.effects import Effect
from axisight.effects.stated import GAIN_OF_POSITION, OTHER_GAINS, TORQUE_CONSTANT, TORQUE_SENSOR
from axisight.errors import InputError
from axisight.fitting import PRIOR_REACH, Parameter, effect_parameter, robot_parameters
from axisight.gap.simulator.tolerances import tolerance_of
from axisight.robot import Robot

UNKNOWN = 1.0
"""Relative tolerance of an unknown torque constant [1]: one standard deviation is a factor of two."""
# Effect of the core that holds an unknown torque constant.
_CONSTANT = TORQUE_CONSTANT[0]
# Parameters of the effect that holds gains.
_FIRST, _SECOND = OTHER_GAINS[1]
# Parameter of the effect *other gains* for each gain, of the controllers whose gains may have a tolerance.
_OF_GAINS: Mapping[str, Mapping[str, str]] = {
    "pd_position": {"kp": _FIRST, "kd": _SECOND},
    "cascade_position": {"kv": GAIN_OF_POSITION[1], "kp": _FIRST, "ki": _SECOND},
}
# Effects that are a part of another one: the error of a torque sensor is part of an unknown torque constant.
_PARTS = {_CONSTANT: (TORQUE_SENSOR[0],)}


@dataclass(frozen=True)
class _Place:
    """The parameter of an effect on an axis (from 1) that an own parameter is in the core."""

    effect: str
    axis: int
    parameter: str

    @property
    def label(self) -> str:
        return Effect(self.effect, self.axis).label

    def stated(self, robot: Robot) -> float:
        """Return the value in the effects that the robot itself states; zero without one."""
        own = next((e for e in robot.effects if e.label == self.label), None)
        return 0.0 if own is None else (own.parameters or {}).get(self.parameter, 0.0)


def _places(robot: Robot) -> dict[str, _Place]:
    """Return, by name, all own parameters that the core has in effects."""
    gains, parameters = robot.controller_gains, _OF_GAINS.get(robot.controller_kind, {})
    out = {}
    for axis, joint in zip(robot.axis_numbers(), robot.axis_names, strict=True):
        out[f"{joint}.{_CONSTANT}"] = _Place(TORQUE_CONSTANT[0], axis, TORQUE_CONSTANT[1])
        # A gain of zero has no relative change; a speed loop may have no integral gain.
        for gain in (gain for gain in parameters if gains[gain][axis - 1] > 0):
            out[f"{joint}.{gain}"] = _Place(OTHER_GAINS[0], axis, parameters[gain])
    return out


def place_of(robot: Robot, name: str) -> tuple[str, str] | None:
    """Return the effect and its parameter that an own parameter is in the core; None if it is one of the robot."""
    place = _places(robot).get(name)
    return None if place is None else (place.effect, place.parameter)


def constant_name(robot: Robot, axis: int) -> str:
    """Return the name of the torque constant of an axis (from 1)."""
    return f"{robot.axis_names[axis - 1]}.{_CONSTANT}"


def gain_names(robot: Robot) -> list[str]:
    """Return the names of the gains of a controller of targets; empty for other controllers."""
    return [name for name, place in _places(robot).items() if place.effect == OTHER_GAINS[0]]


def gain_quantities(robot: Robot) -> list[str]:
    """Return the gains (``kp``) of a controller of targets that may have a tolerance; empty for other controllers."""
    return list(dict.fromkeys(name.rsplit(".", 1)[1] for name in gain_names(robot)))


def nominal_values(robot: Robot) -> dict[str, float]:
    """Return the values of a robot's parameters, and zero for its gains, by name."""
    return {**robot_parameters(robot), **dict.fromkeys(gain_names(robot), 0.0)}


def nominal_and_size(robot: Robot, name: str) -> tuple[float, float]:
    """Return the nominal value of a parameter by name, and the size to which its changes are relative."""
    place = _places(robot).get(name)
    if place is None:
        value = robot_parameters(robot)[name]
        return value, abs(value) or 1.0
    return place.stated(robot), 1.0 + place.stated(robot)


def unknown_constants(robot: Robot, axes: Sequence[int]) -> list[Parameter]:
    """Return the unknown torque constants of ``axes`` (from 1) as parameters of a fit."""
    return [_uncertain(robot, constant_name(robot, axis), UNKNOWN) for axis in axes]


def has_unknown_constants(robot: Robot, own: Sequence[Parameter]) -> bool:
    """Whether torque constants are among the parameters ``own`` of a fit: then bodies tell the scale of torques."""
    constants = {constant_name(robot, axis) for axis in robot.axis_numbers()}
    return any(parameter.name in constants for parameter in own)


def uncertain_gains(robot: Robot, tolerances: Mapping[str, float]) -> list[Parameter]:
    """Return the gains that have a tolerance as parameters of a fit.

    Raises InputError for a tolerance that is not positive, and for a robot that also states other gains as an
    effect.
    """
    known = {name: tolerance_of(tolerances, name) for name in gain_names(robot)}
    out = [
        _uncertain(robot, name, positive(f"tolerances: {name}", x))
        for name, x in known.items()
        if x is not None
    ]
    stated = [e.label for e in robot.effects if e.name == OTHER_GAINS[0]]
    if out and stated:
        raise InputError(
            f"tolerances: expected gains without {stated[0]} where they have one ({out[0].name}), got both"
        )
    return out


def _uncertain(robot: Robot, name: str, tolerance: float) -> Parameter:
    """Return an own parameter for a fit; its prior is the stated value with the relative tolerance."""
    place, (mean, size) = _places(robot)[name], nominal_and_size(robot, name)
    effect = Effect(place.effect, place.axis, {place.parameter: mean})
    known, spread = effect_parameter([effect], 0, place.parameter), tolerance * size
    return replace(
        known,
        name=name,
        effect=None,
        lower=max(known.lower, mean - PRIOR_REACH * spread),
        upper=min(known.upper, mean + PRIOR_REACH * spread),
        scale=spread,
        prior=(mean, spread),
    )


def absorbed(robot: Robot, parameters: Sequence[Parameter]) -> frozenset[str]:
    """Return the labels of effects that cannot be causes, since these own parameters contain them."""
    places = [place for p in parameters if (place := _places(robot).get(p.name)) is not None]
    return frozenset(
        Effect(effect, place.axis).label
        for place in places
        for effect in (place.effect, *_PARTS.get(place.effect, ()))
    )


def split(robot: Robot, values: Mapping[str, float]) -> tuple[dict[str, float], list[Effect]]:
    """Return the values of a robot's parameters, and the effects that hold the other own parameters."""
    places = _places(robot)
    own: dict[tuple[str, int], dict[str, float]] = {}
    for name, place in places.items():
        if name in values:
            own.setdefault((place.effect, place.axis), {})[place.parameter] = values[name]
    effects = [Effect(effect, axis, changes) for (effect, axis), changes in sorted(own.items())]
    return {name: value for name, value in values.items() if name not in places}, effects


def with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with fitted values of its own parameters, in effects or not."""
    plain, own = split(robot, values)
    changed = robot.with_parameters(plain)
    if not own:
        return changed
    effects = {effect.label: effect for effect in (*changed.effects, *own)}
    return changed.with_effects(list(effects.values()))


def for_core(
    robot: Robot, effects: Sequence[Effect], parameters: Sequence[Parameter]
) -> tuple[list[Effect], list[Parameter]]:
    """Return effects and parameters as the core expects them, the effects of own parameters last."""
    places = _places(robot)
    _, own = split(robot, {p.name: p.initial for p in parameters if p.effect is None})
    at = {effect.label: i for i, effect in enumerate(own, start=len(effects))}
    return [*effects, *own], [
        replace(p, name=places[p.name].parameter, effect=at[places[p.name].label])
        if p.effect is None and p.name in places
        else p
        for p in parameters
    ]
