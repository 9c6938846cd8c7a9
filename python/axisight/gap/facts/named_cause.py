"""A cause as the estimation logs name it."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.gap.facts.result import Interval, label


@dataclass(frozen=True)
class NamedCause:
    """A cause before its effect on the validation logs is measured.

    ``axes``: both, where it acts between two; ``axis`` is the first of them.
    """

    effect: str
    axis: int | None
    probability: float
    parameters: dict[str, Interval]
    units: dict[str, str]
    family: str
    family_probability: float
    axes: tuple[int, int] | None = None

    @property
    def label(self) -> str:
        """``effect@axis``, or the effect alone when it belongs to the whole arm."""
        return label(self.effect, self.axis, self.axes)
