"""Which two causes stay open, and the models that stand for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.evidence import Evidence
from axisight.gap.state import Search

Array = NDArray[np.float64]

# An alternative less likely than this is none.
_LIKELY = 0.05


@dataclass(frozen=True, eq=False)
class Rivals:
    """Two fitted models that explain the logs by different causes, the last effect of each.

    ``labels``: of these, ``effect@axis``. Of the logs, by axis: ``samples`` (n_axes,) and what there
    was ``to_explain`` (n_axes,), as a mean square of the weighted residual above the noise.
    """

    labels: tuple[str, str]
    models: tuple[Evidence, Evidence]
    samples: Array
    to_explain: Array

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
        (other.probability / max(first.probability, 1e-300), first.trial, other.trial)
        for first, standing in found.accepted
        for other in standing.ranked
        if other.trial.label not in accepted and other.probability >= _LIKELY
    ]
    if not open_pairs:
        return None
    _, first, other = max(open_pairs, key=lambda x: x[0])
    samples = found.layout.samples()
    return Rivals(
        (first.label, other.label),
        (first.evidence, other.evidence),
        samples,
        np.maximum(found.to_explain(), 0.0) / samples,
    )
