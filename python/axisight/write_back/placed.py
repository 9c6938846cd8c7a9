"""The fate of causes: written to the model, or why not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from axisight.effects import effect_info
from axisight.gap.facts.wording import listed

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause


class Labelled(Protocol):
    """A cause or a re-fitted gain."""

    @property
    def label(self) -> str:
        """The label."""


@dataclass
class Placed:
    """Labels of the causes in the model, and by label why the others are not."""

    there: set[str] = field(default_factory=set)
    why_not: dict[str, str] = field(default_factory=dict)

    def refuse(self, causes: Sequence[Labelled], why: str) -> None:
        """Record why causes are not in the model."""
        self.why_not |= {cause.label: why for cause in causes}

    def joined(self, other: Placed) -> Placed:
        """Return both records as one."""
        return Placed(self.there | other.there, self.why_not | other.why_not)

    def take(self, causes: Sequence[Labelled]) -> None:
        """Record that causes are in the model."""
        self.there |= {cause.label for cause in causes}


def said(causes: Sequence[Cause], more: Sequence[str] = ()) -> str:
    """Return the text of a comment: values, intervals, probabilities and rivals of causes, then ``more``."""
    return "axisight: " + "; ".join([*map(_cause, causes), *more])


def _cause(cause: Cause) -> str:
    info = effect_info(cause.effect)
    side = " on the motor" if info.acts in ("motor", "torque_path") else ""
    values = []
    for name in (p.name for p in info.parameters if p.role == "amplitude"):
        value, unit = cause.parameters.get(name), cause.units.get(name, "")
        if value is not None:
            text = f"{name} = {value.value:.4g} ({value.low:.4g} to {value.high:.4g})"
            values.append(text if unit in ("", "1") else f"{text} {unit}{side}")
    parts = [*values, f"probability {cause.probability:.2f}", *doubt(cause)]
    return f"{cause.label}: {', '.join(parts)}"


def doubt(cause: Cause) -> list[str]:
    """Return one item if the data cannot tell a cause from others, else none."""
    return [f"the data cannot tell it from {listed(cause.rivals, 'or')}"] if cause.rivals else []
