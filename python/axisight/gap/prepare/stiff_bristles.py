"""Bristles that a fit can follow: slipping faster than its fixed steps, they fly apart."""

from __future__ import annotations

from axisight.effects import Effect, effect_info
from axisight.gap.facts.faults import Finding
from axisight.robot import Robot


def with_bristles_followed(robot: Robot) -> tuple[Robot, tuple[Finding, ...]]:
    """Return a simulator whose bristles slip no faster than a step, and a finding for each that did.

    With a relaxation of one step ``T`` the rate of the bristles is ``1 / T`` at most, of which Runge-Kutta steps
    of order four stand 2.8.
    """
    step = robot.sample_time_s
    fast = {e: names for e in robot.effects if (names := _faster(e, step))}
    if not fast:
        return robot, ()
    slowed = [
        e.with_values(dict.fromkeys(fast[e], step)) if e in fast else e for e in robot.effects
    ]
    told = (_told(e, name, step) for e, names in fast.items() for name in names)
    return robot.with_effects(slowed), tuple(told)


def _faster(effect: Effect, step: float) -> list[str]:
    """Return the parameters by which an effect changes faster than a step."""
    times = effect_info(effect.name).marked("fastest_time")
    return [name for name in times if _value(effect, name) < step]


def _value(effect: Effect, parameter: str) -> float:
    return float((effect.parameters or {}).get(parameter, 0.0))


def _told(effect: Effect, relaxation: str, step: float) -> Finding:
    message = (
        f"{effect.label}: expected {relaxation} of at least a sample time ({step:g} s), got "
        f"{_value(effect, relaxation):g}. The bristles slip faster than the fixed steps of a fit can follow. "
        f"{step:g} s is used instead"
    )
    return Finding("bristles_slowed", "flag", message, axis=effect.axis, field=relaxation)
