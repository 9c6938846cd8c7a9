"""What explains one axis is believed there, though other axes keep a gap that nothing explains.

By inverse dynamics the error of an axis is its own: friction missing on axis 1 is none the less sure
for a wrist that no effect describes. The arm as a whole stays *unknown*, and the causes stand beside
it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from axisight.fitting.divergence import must_hold
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.measure.gap_figures import Stage
from axisight.gap.search.state import SearchState

# Share of what causes change on validation logs, in squares, by which they have to lower the gap
# there: 1 where they are right, 0 where half of their size would be, -1 where they have nothing to
# do with it. A motion that asks little of an effect changes little, and is asked for little.
_CARRIED = 0.25


def believed_by_axis(found: SearchState, fitter: ModelFitter, settings: Settings) -> SearchState:
    """Return the search with the causes of those axes only that they explain well enough.

    Unchanged where errors of axes do not add up, and where no axis is explained.
    """
    if not fitter.adds_up or not found.accepted:
        return found
    arm = found.explained() >= settings.explained_share
    share = found.removed() / np.maximum(found.to_explain(), 1e-300)
    well = [s.axis for _, s in found.accepted if share[s.axis] >= settings.explained_share]
    if not well:
        return found
    return replace(_of_axes(found, fitter, set(well)), by_axis=not arm)


def without_axis(found: SearchState, fitter: ModelFitter, axis: int) -> SearchState:
    """Return the search without the causes that stood first on ``axis`` (from 0).

    The others explain their axes; whether they explain the arm does not matter any more.
    """
    left = {s.axis for _, s in found.accepted} - {axis}
    return replace(_of_axes(found, fitter, left), by_axis=True)


def _of_axes(found: SearchState, fitter: ModelFitter, axes: set[int]) -> SearchState:
    kept = [f for f, (_, s) in zip(found.model.free, found.accepted, strict=True) if s.axis in axes]
    if len(kept) == len(found.model.free):
        return found
    out = replace(found, steps=[*found.steps])
    out.moved("own_axes", must_hold(settled(fitter, kept, found.model)))
    return out


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
