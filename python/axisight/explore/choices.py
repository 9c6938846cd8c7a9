"""Effects as a user chooses them: places, usual sizes and slider ranges."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

from axisight.effects import Effect, EffectInfo, EffectParameter, effect_info, effect_table
from axisight.errors import InputError
from axisight.robot import Robot

Place = int | tuple[int, int] | None

# A slider reaches so many typical sizes; bounds alone may be a million of them.
_REACH = 5.0
# A limit that switches an effect off lies so many typical sizes away.
_FAR = 1e3


def places(info: EffectInfo, n_axes: int) -> list[Place]:
    """Return the places where an effect can act on an arm: axes from 1, ordered pairs of axes, or None."""
    if info.scope == "arm":
        return [None]
    axes = range(1, n_axes + 1)
    return list(axes) if info.scope == "axis" else list(permutations(axes, 2))


def at_place(name: str, place: Place, values: dict[str, float]) -> Effect:
    """Return an effect at a place; raises InputError as `Effect` does."""
    if isinstance(place, tuple):
        return Effect(name, None, values, place)
    return Effect(name, place, values)


def usual(name: str, place: Place) -> Effect:
    """Return an effect with its first amplitude at its typical size and the others neutral."""
    parameters = effect_info(name).parameters
    values = {p.name: p.neutral for p in parameters}
    first = next(p for p in parameters if p.role == "amplitude")
    base = first.neutral if abs(first.neutral) < _FAR * first.typical else 0.0
    values[first.name] = min(max(base + first.typical, first.lower), first.upper)
    return at_place(name, place, values)


def usable(robot: Robot, *, inverse_dynamics: bool = False) -> dict[str, list[Place]]:
    """Return the effects that a robot can have, by name, with their places.

    Effects that the robot refuses on every axis are left out, such as backlash of a rigid transmission. With
    ``inverse_dynamics``, effects that change no torque computed from the measured motion are left out too,
    such as a sensor delay.
    """
    found = {}
    for name, info in effect_table().items():
        if inverse_dynamics and not info.inverse_dynamics:
            continue
        possible = [p for p in places(info, robot.n_axes) if _possible(robot, name, p)]
        if possible:
            found[name] = possible
    return found


def _possible(robot: Robot, name: str, place: Place) -> bool:
    try:
        robot.with_effects([usual(name, place)])
    except InputError:
        return False
    return True


def slider_range(p: EffectParameter, value: float) -> tuple[float, float]:
    """Return the ends of a slider: a few typical sizes about the neutral value, within the bounds.

    The range always contains ``value``.
    """
    middle = p.neutral if abs(p.neutral) < _FAR * p.typical else 0.0
    if p.role == "shape":
        middle = 0.0
    reach = max(_REACH * p.typical, 2 * abs(value - middle) if value != p.neutral else 0.0)
    return max(p.lower, middle - reach), min(p.upper, middle + reach)


def in_bounds(effect: Effect) -> Effect:
    """Return the effect with every value clipped to the bounds of the table."""
    parameters = effect_info(effect.name).parameters
    pairs = zip(parameters, effect.values(), strict=True)
    return effect.with_values({p.name: min(max(v, p.lower), p.upper) for p, v in pairs})


def with_effect(effects: Sequence[Effect], new: Effect) -> tuple[Effect, ...]:
    """Return the effects with one more; it replaces one of the same name and axis."""
    return (*(e for e in effects if e.label != new.label), new)
