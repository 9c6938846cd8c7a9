"""What a simulator states of an effect: its own parameter that the effect changes, or the effect itself."""

from __future__ import annotations

from axisight.effects import Effect, effect_info
from axisight.robot import Robot


def stated_amplitude(effect: Effect, robot: Robot) -> float:
    """Return the amplitude that a simulator states for an effect, as its own parameter or as an effect; else zero."""
    return stated_values(effect, robot)[effect_info(effect.name).parameters[0].name]


def stated_values(effect: Effect, robot: Robot) -> dict[str, float]:
    """Return what a simulator states of an effect, by parameter; its own parameter counts as the first one."""
    first, *others = (p.name for p in effect_info(effect.name).parameters)
    acting = (e for e in robot.effects if e.label == effect.label and e.acts)
    values = next((dict(zip((first, *others), e.values(), strict=True)) for e in acting), {})
    own = own_parameter(robot, effect)
    added = 0.0 if own is None else robot.parameters()[own]
    return {**values, first: values.get(first, 0.0) + added}


def own_parameter(robot: Robot, effect: Effect) -> str | None:
    """Return the name of the simulator's own parameter that an effect changes; None if there is none."""
    stands_for = effect_info(effect.name).stands_for
    if stands_for is None or effect.axis is None:
        return None
    return robot.axis_parameter(effect.axis, stands_for[0])
