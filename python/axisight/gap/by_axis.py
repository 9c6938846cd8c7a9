"""What explains one axis is believed there, though other axes keep a gap that nothing explains.

By inverse dynamics the error of an axis is its own: friction missing on axis 1 is none the less sure
for a wrist that no effect describes. The arm as a whole stays *unknown*, and the causes stand beside
it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from axisight.gap.howfar import Stage
from axisight.gap.model import ModelFitter
from axisight.gap.search import Search
from axisight.gap.settings import Settings
from axisight.gap.trials import settled

# Share of what causes change on validation logs, in squares, by which they have to lower the gap
# there: 1 where they are right, 0 where half of their size would be, -1 where they have nothing to
# do with it. A motion that asks little of an effect changes little, and is asked for little.
_CARRIED = 0.25


def believed_by_axis(found: Search, fitter: ModelFitter, settings: Settings) -> Search:
    """Return the search with the causes of those axes only that they explain well enough.

    Unchanged where they explain the arm, and where errors of axes do not add up.
    """
    if not fitter.adds_up or not found.accepted or found.explained() >= settings.explained_share:
        return found
    excess, removed = found.to_explain(), found.removed()
    share = removed / np.maximum(excess, 1e-300)
    well = [
        f
        for f, (_, s) in zip(found.model.free, found.accepted, strict=True)
        if share[s.axis] >= settings.explained_share
    ]
    if not well:
        return found
    model = found.model
    if len(well) < len(model.free):
        model = settled(fitter, well, model)
    return replace(found, model=model, by_axis=True)


@dataclass(frozen=True)
class OwnAxes:
    """How causes fare on the ``axes`` (from 0) they explain, on the validation logs.

    ``given``, ``after``: the error of the simulator as given and with the causes; ``change``: what
    the causes change of its torque.
    """

    axes: Sequence[int]
    given: Stage
    after: Stage
    change: Stage

    def not_carried(self) -> int | None:
        """Return the first axis (from 0) whose gap does not fall as the causes say; or None."""
        given, after, change = (
            np.mean(s.per_log(), axis=0) for s in (self.given, self.after, self.change)
        )
        return next((i for i in self.axes if given[i] - after[i] < _CARRIED * change[i]), None)
