"""Fits that continue until further steps bring no improvement."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.model_fitter import ModelFitter

SETTLED = 1e-3
"""A fit has settled if one more step promises less than this share of the loss."""
RENEWALS = 1
"""Number of times that sensitivities are renewed in the fit of a cause."""


def settled(
    fitter: ModelFitter,
    free: Sequence[Hypothesis],
    start: FittedModel,
    *,
    rough: ModelFitter | None = None,
    max_iterations: int = 6,
    worth: float | None = None,
) -> FittedModel | Diverged:
    """Return a fit with sensitivities of its own, renewed as often as it needs.

    ``rough``: fitter for part of the data, which makes most of the way at lower cost; ``worth``: fall of the loss at
    which the fit ends, by default where it has settled.
    """
    least = SETTLED * start.total if worth is None else worth
    if start.renewed and len(free) == len(start.free):
        return _renewed(fitter, start, max_iterations, least)
    renewals = RENEWALS
    if rough is not None and not (len(free) == len(start.free) and has_settled(start)):
        begun = rough.fit(free, start, refreshes=renewals, worth=least)
        begun = _renewed(rough, begun, max_iterations, least)
        if not isinstance(begun, Diverged):
            start, free, renewals = begun, begun.free, 0
    found = fitter.fit(free, start, refreshes=renewals, worth=least)
    return _renewed(fitter, found, max_iterations, least)


def _renewed(
    fitter: ModelFitter, found: FittedModel | Diverged, max_iterations: int, worth: float
) -> FittedModel | Diverged:
    """Return a fit; if it has not settled, continued with new sensitivities at every step."""
    if isinstance(found, Diverged) or has_settled(found):
        return found
    return fitter.fit(found.free, found, fresh=True, max_iterations=max_iterations, worth=worth)


def has_settled(found: FittedModel) -> bool:
    """Whether further steps of a fit bring no improvement."""
    return found.converged or found.stuck or linear_gain(found) < SETTLED * found.total
