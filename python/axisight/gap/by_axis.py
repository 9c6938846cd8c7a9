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

# Share of a fall of the gap on the estimation logs that validation logs have to show: other motions
# ask less of an effect, but not nothing.
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
    """How causes fare on the ``axes`` (from 0) they explain.

    ``estimation``, ``validation``: with the simulator as given and with the causes.
    """

    axes: Sequence[int]
    estimation: tuple[Stage, Stage]
    validation: tuple[Stage, Stage]

    def not_carried(self) -> int | None:
        """Return the first axis (from 0) whose gap does not fall on the validation logs; or None."""
        seen, held = (
            np.mean(given.per_log(), axis=0) - np.mean(after.per_log(), axis=0)
            for given, after in (self.estimation, self.validation)
        )
        return next((i for i in self.axes if held[i] < _CARRIED * seen[i]), None)
