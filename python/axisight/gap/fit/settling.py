"""Fits that go on until steps bring no more."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.model_fitter import ModelFitter

SETTLED = 1e-3
"""Share of a loss that another step of a fit may promise where it has settled."""
RENEWALS = 1
"""How often sensitivities are renewed in a fit that is to last."""


def settled(
    fitter: ModelFitter,
    free: Sequence[Hypothesis],
    start: FittedModel,
    *,
    rough: ModelFitter | None = None,
    max_iterations: int = 6,
    worth: float | None = None,
) -> FittedModel | Diverged:
    """Return a fit with sensitivities of its own, as often renewed as it needs.

    ``rough``: the same for part of the data, which brings what bends the simulator most of the way;
    ``worth``: loss that another step has to bring, where it is not a share of it.
    """
    if start.renewed and len(free) == len(start.free):
        return _renewed(fitter, start, max_iterations)
    renewals = RENEWALS
    if rough is not None:
        begun = _renewed(rough, rough.fit(free, start, refreshes=renewals), max_iterations)
        if not isinstance(begun, Diverged):
            start, free, renewals = begun, begun.free, 0
    found = fitter.fit(free, start, refreshes=renewals, worth=worth)
    return _renewed(fitter, found, max_iterations)


def _renewed(
    fitter: ModelFitter, found: FittedModel | Diverged, max_iterations: int
) -> FittedModel | Diverged:
    """Return a fit, with sensitivities renewed at every step where it has not settled without."""
    if isinstance(found, Diverged) or has_settled(found):
        return found
    return fitter.fit(found.free, found, fresh=True, max_iterations=max_iterations)


def has_settled(found: FittedModel) -> bool:
    """Whether steps of a fit bring no more."""
    return found.converged or found.stuck or linear_gain(found) < SETTLED * found.total
