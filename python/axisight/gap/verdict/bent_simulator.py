"""Whether causes still explain the gap with the simulator's own parameters kept near their values."""

from __future__ import annotations

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.tolerance_edges import BENT, bent
from axisight.gap.search.state import SearchState

# Tolerances within which the simulator's own parameters are kept: one machine in twenty is further off
# in one of them.
_WITHIN = 2.0
# Share of what there is to explain that the causes have to explain then.
_HOLD = 0.95


def bent_for(fitter: ModelFitter, found: SearchState) -> float:
    """Return the share of own parameters at the edge of their tolerance [1]; zero where the causes do without.

    The rest of a large gap is large against noise. It pulls parameters that the logs hardly determine to the
    edge of their tolerance. That is harmless where the causes explain as much with these parameters kept
    near their values.
    """
    share = bent(fitter, found.model)
    asked = share >= BENT and len(found.model.free) > 0
    return 0.0 if asked and _hold_straight(fitter, found) else share


def _hold_straight(fitter: ModelFitter, found: SearchState) -> bool:
    """Whether the causes explain nearly all with the simulator's own parameters kept near their values."""
    straight = fitter.within(_WITHIN)
    before = straight.fit([], found.baseline, refreshes=1)
    left = straight.fit(found.model.free, found.model, refreshes=1)
    if isinstance(before, Diverged) or isinstance(left, Diverged):
        return False
    noise = float(found.floor.sum())
    return before.total - left.total >= _HOLD * (before.total - noise)
