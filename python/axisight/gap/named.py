"""A cause as the estimation logs name it."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.gap.result import Interval


@dataclass(frozen=True)
class NamedCause:
    """A cause before its effect on the validation logs is measured."""

    effect: str
    axis: int | None
    probability: float
    parameters: dict[str, Interval]
    units: dict[str, str]
    family: str
    family_probability: float
