"""Loads that differ from log to log or from response to response."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.effects import Effect, effect_info
from axisight.errors import InputError
from axisight.logs.load import Load
from axisight.robot import Robot

OwnValues = list[tuple[int, int, float]]
"""Values of effect parameters that hold in one log only: effect, parameter, value."""


def payload_of(load: Load) -> Effect:
    """Return the effect of a load that is mounted."""
    return Effect("payload", None, load.parameters)


def with_loads(
    robot: Robot, effects: Sequence[Effect], loads: Sequence[Load | None]
) -> tuple[list[Effect], list[OwnValues]]:
    """Return the effects, with a payload if any of ``loads`` is given, and the own values of each load.

    Where a load is None, the robot's own payload, if it has one, stays. Raises InputError for a payload among
    ``effects`` beside loads.
    """
    out = list(effects)
    if all(load is None for load in loads):
        return out, [[] for _ in loads]
    if any(effect.name == "payload" for effect in out):
        raise InputError("effects: expected no payload beside logs that state their load, got one")
    own = [effect for effect in robot.effects if effect.name == "payload"]
    out.append(own[0] if own else Effect("payload", None, {"mass_kg": 0.0}))
    place = len(out) - 1
    names = [p.name for p in effect_info("payload").parameters]
    return out, [
        []
        if load is None
        else [(place, names.index(name), value) for name, value in load.parameters.items()]
        for load in loads
    ]
