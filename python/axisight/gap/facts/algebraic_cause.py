"""Causes that logs show without a model of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from axisight.effects import Effect
from axisight.gap.facts.result import Interval


@dataclass(frozen=True)
class AlgebraicCause:
    """An effect of one axis (from 1), or of the arm, that logs show by themselves.

    ``values``: its parameters; ``samples``: how many show it; ``explained``: share of the difference between
    logged torque and the controller's command that it removes [1]; ``says``: a sentence on what was seen.
    """

    name: str
    axis: int | None
    values: Mapping[str, Interval]
    samples: int
    explained: float
    says: str

    @property
    def effect(self) -> Effect:
        """The effect."""
        return Effect(self.name, self.axis, {k: v.value for k, v in self.values.items()})
