"""Bristles that a fit can follow: slipping faster than its fixed steps, they fly apart."""

from __future__ import annotations

from axisight.effects import Effect
from axisight.effects.stated import BRISTLES
from axisight.gap.facts.faults import Finding
from axisight.robot import Robot


def with_bristles_followed(robot: Robot) -> tuple[Robot, tuple[Finding, ...]]:
    """Return a simulator whose bristles slip no faster than a step, and a finding for each that did.

    With a relaxation of one step ``T`` the rate of the bristles is ``1 / T`` at most, of which Runge-Kutta steps
    of order four stand 2.8.
    """
    name, _, relaxation = BRISTLES
    step = robot.sample_time_s
    fast = [e for e in robot.effects if e.name == name and _value(e, relaxation) < step]
    if not fast:
        return robot, ()
    slowed = [e.with_values({relaxation: step}) if e in fast else e for e in robot.effects]
    return robot.with_effects(slowed), tuple(_told(e, relaxation, step) for e in fast)


def _value(effect: Effect, parameter: str) -> float:
    return float((effect.parameters or {}).get(parameter, 0.0))


def _told(effect: Effect, relaxation: str, step: float) -> Finding:
    message = (
        f"{effect.label}: expected {relaxation} of a sample time ({step:g} s) or more, got "
        f"{_value(effect, relaxation):g}: bristles slip faster than the fixed steps of a fit follow. They are "
        f"taken with {step:g} s, and touch and part over as long."
    )
    return Finding("bristles_slowed", "flag", message, axis=effect.axis, field=relaxation)
