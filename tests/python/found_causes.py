"""Causes in the form of a diagnosis."""

from __future__ import annotations

from axisight.gap.facts.result import Cause, Interval


def several(effect: str, axis: int | None, **values: float) -> Cause:
    """Return a cause with probability 0.9 and these parameters, in SI units."""
    parameters = {name: Interval(value, value, value) for name, value in values.items()}
    return Cause(effect, axis, 0.9, parameters, {}, Interval(50.0, 40.0, 60.0))
