"""Slows bristles of friction effects that relax faster than the fixed steps of a fit can follow."""

from __future__ import annotations

from axisight.effects import Effect, effect_info
from axisight.gap.facts.faults import Finding
from axisight.robot import Robot


def with_bristles_followed(robot: Robot) -> tuple[Robot, tuple[Finding, ...]]:
    """Return a simulator whose bristles relax no faster than one step, and a finding for each changed one.

    With a relaxation time of one step ``T`` the rate of the bristles is at most ``1 / T``. A Runge-Kutta step
    of order four is stable up to ``2.8 / T``.
    """
    step = robot.sample_time_s
    fast = {e: names for e in robot.effects if (names := _too_fast(e, step))}
    if not fast:
        return robot, ()
    slowed = [
        e.with_values(dict.fromkeys(fast[e], step)) if e in fast else e for e in robot.effects
    ]
    told = (_finding(e, name, step) for e, names in fast.items() for name in names)
    return robot.with_effects(slowed), tuple(told)


def _too_fast(effect: Effect, step: float) -> list[str]:
    """Return the time parameters of an effect that are shorter than a step."""
    times = effect_info(effect.name).marked("fastest_time")
    return [name for name in times if _value(effect, name) < step]


def _value(effect: Effect, parameter: str) -> float:
    return float((effect.parameters or {}).get(parameter, 0.0))


def _finding(effect: Effect, relaxation: str, step: float) -> Finding:
    message = (
        f"{effect.label}: expected {relaxation} of at least a sample time ({step:g} s), got "
        f"{_value(effect, relaxation):g}. The bristles slip faster than the fixed steps of a fit can follow. "
        f"{step:g} s is used instead"
    )
    return Finding("bristles_slowed", "flag", message, axis=effect.axis, field=relaxation)
