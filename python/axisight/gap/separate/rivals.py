"""Which two causes stay open, and the models that stand for them."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.gap.model import Evidence
from axisight.gap.search import Search

# An alternative less likely than this is none.
_LIKELY = 0.05


@dataclass(frozen=True, eq=False)
class Rivals:
    """Two fitted models that explain the logs by different causes; ``labels`` ``effect@axis`` of these."""

    labels: tuple[str, str]
    models: tuple[Evidence, Evidence]

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) they act on; none for effects of the whole arm alone."""
        found = {m.free[-1].effect.axis for m in self.models}
        return tuple(sorted(a for a in found if a is not None))


def rivals_of(found: Search) -> Rivals | None:
    """Return the two causes of a search that are most nearly as likely; None where all is clear.

    Of every cause, the likeliest rival that is no cause itself, at least one in twenty.
    """
    accepted = {r.trial.label for r, _ in found.accepted}
    open_pairs = [
        (other.probability / max(first.probability, 1e-300), first, other)
        for first, standing in found.accepted
        for other in standing.ranked
        if other.trial.label not in accepted and other.probability >= _LIKELY
    ]
    if not open_pairs:
        return None
    _, first, other = max(open_pairs, key=lambda x: x[0])
    return Rivals(
        (first.trial.label, other.trial.label), (first.trial.evidence, other.trial.evidence)
    )
