"""Causes as a diagnosis finds them."""

from __future__ import annotations

from axisight.gap.facts.result import Cause, Interval


def several(effect: str, axis: int | None, **values: float) -> Cause:
    """Return a cause of a probability of 0.9 by its parameters, in SI units."""
    parameters = {name: Interval(value, value, value) for name, value in values.items()}
    return Cause(effect, axis, 0.9, parameters, {}, Interval(50.0, 40.0, 60.0))
