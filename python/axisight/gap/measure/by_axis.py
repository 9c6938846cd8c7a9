"""Accepts causes axis by axis, if other axes keep a gap that nothing explains.

In inverse dynamics the error of an axis is its own. Friction missing on axis 1 is no less sure if no effect explains
the wrist. The verdict for the whole arm stays *unknown*, and the causes are reported beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from axisight.fitting.divergence import must_hold
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.measure.gap_figures import Stage
from axisight.gap.search.state import SearchState

# Smallest fall of the squared gap on validation logs, as a share of the squared torque change by the causes. The ratio
# is 1 for a correct cause, 0 if the true size is half of it, and -1 for an unrelated one. A motion that hardly excites
# an effect changes little, and needs to show little.
_CARRIED = 0.25


def believed_by_axis(found: SearchState, fitter: ModelFitter, settings: Settings) -> SearchState:
    """Return the search with only the causes of axes that they explain well enough.

    Unchanged if the errors of the axes do not add up (closed loop), or if no axis is explained.
    """
    if not fitter.adds_up or not found.accepted:
        return found
    arm = found.explained() >= settings.explained_share
    share = found.removed() / np.maximum(found.to_explain(), 1e-300)
    well = [s.axis for _, s in found.accepted if share[s.axis] >= settings.explained_share]
    if not well:
        return found
    kept = [f for f, axis in led(found) if axis in well or f.sure]
    return replace(_with_only(found, fitter, kept), by_axis=not arm)


def without_axis(found: SearchState, fitter: ModelFitter, axis: int) -> SearchState:
    """Return the search without the causes that led ``axis`` (from 0), sure ones included.

    The other causes explain their axes, whatever the share of the whole arm that they explain.
    """
    kept = [f for f, place in led(found) if place != axis]
    return replace(_with_only(found, fitter, kept), by_axis=True)


def led(found: SearchState) -> list[tuple[Hypothesis, int]]:
    """Return every cause with the axis (from 0) that it led."""
    return [(f, s.axis) for f, (_, s) in zip(found.model.free, found.accepted, strict=True)]


def _with_only(found: SearchState, fitter: ModelFitter, kept: list[Hypothesis]) -> SearchState:
    if len(kept) == len(found.model.free):
        return found
    out = replace(found, steps=[*found.steps])
    out.moved("own_axes", must_hold(settled(fitter, kept, found.model)))
    return out


@dataclass(frozen=True)
class OwnAxes:
    """Errors on the validation logs that show whether causes hold on the ``axes`` that they explain.

    ``axes``: the labels of the causes by the axis (from 0) that they led; a heavier link may lead any axis below it.
    ``given``, ``after``: errors of the simulator as given and with the causes; ``change``: torque change by the causes.
    """

    axes: Mapping[int, tuple[str, ...]]
    given: Stage
    after: Stage
    change: Stage

    def not_carried(self) -> int | None:
        """Return the first axis (from 0) whose gap falls less than its causes promise; None if there is none."""
        given, after, change = (
            np.mean(s.per_log(), axis=0) for s in (self.given, self.after, self.change)
        )
        return next(
            (i for i in sorted(self.axes) if given[i] - after[i] < _CARRIED * change[i]), None
        )
