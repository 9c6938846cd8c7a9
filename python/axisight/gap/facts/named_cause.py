"""A cause as the estimation logs name it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from axisight.gap.facts.result import Interval, label
from axisight.gap.facts.trace import Adjustment, log_odds


@dataclass(frozen=True)
class NamedCause:
    """A cause before its effect on the validation logs is measured.

    ``axes``: both, where it acts between two; ``axis`` is the first of them. ``ledger``: what changed its
    probability since it was named.
    """

    effect: str
    axis: int | None
    probability: float
    parameters: dict[str, Interval]
    units: dict[str, str]
    family: str
    family_probability: float
    axes: tuple[int, int] | None = None
    ledger: tuple[Adjustment, ...] = ()

    def adjusted(self, rule: str, times: float) -> NamedCause:
        """Return the cause with its probability multiplied, by a rule of `axisight.gap.facts.trace.RULES`."""
        entry = Adjustment(rule, self.label, log_odds(times))
        return replace(self, probability=times * self.probability, ledger=(*self.ledger, entry))

    @property
    def label(self) -> str:
        """``effect@axis``, or the effect alone when it belongs to the whole arm."""
        return label(self.effect, self.axis, self.axes)
