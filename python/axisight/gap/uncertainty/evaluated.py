"""The model of a verdict, fitted on to the optimum, with fresh sensitivities there."""

from __future__ import annotations

from copy import copy

import numpy as np

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.work_count import WorkCount
from axisight.gap.search.balanced_values import inflation
from axisight.gap.uncertainty.covariance import inverse, sandwich
from axisight.posterior.settings import SMALLEST_STEP, STEP_LEFT


def own_fitter(fitter: ModelFitter, model: FittedModel) -> ModelFitter:
    """Return a fitter that weighs data and tolerances as the final fit of a model does, and counts no work.

    Where errors of axes add up, that is the balanced fit.
    """
    other = copy(fitter)
    other.work = WorkCount()
    if not fitter.adds_up:
        return other
    excess = inflation(model)
    return other.tempered(1 / np.sqrt(excess)) if (excess > 1).any() else other


def evaluated(fitter: ModelFitter, model: FittedModel) -> FittedModel:
    """Return a model with fresh normal equations at its optimum; as it is if it cannot be simulated.

    The fits of a diagnosis end once the loss falls by less than 1e-4 of itself. Where the scatter of estimates is far
    below what the weights say, the step that is left then exceeds a standard error. So the fit goes on, from the values
    of the verdict, until at most `STEP_LEFT` standard errors are left (`least_fall`). If it does not get there, the
    values stay those of the verdict.

    ``fitter``: that of `own_fitter`.
    """
    here = fitter.fit(model.free, model, fresh=True, max_iterations=0)
    if isinstance(here, Diverged):
        return model
    if not here.parameters:
        return here
    precise = copy(fitter)
    precise.step_tolerance = SMALLEST_STEP
    there = precise.fit(here.free, here, fresh=True, worth=least_fall(here))
    if isinstance(there, Diverged) or not (there.converged or there.stuck):
        return here
    found = fitter.fit(there.free, there, fresh=True, max_iterations=0)
    return here if isinstance(found, Diverged) else found


def least_fall(at: FittedModel) -> float:
    """Return the fall of the loss below which no parameter is `STEP_LEFT` standard errors from the optimum.

    A step d with the predicted fall f = d' H d obeys d_i^2 <= (H^-1)_ii f (Cauchy-Schwarz). So f is `STEP_LEFT`
    squared, times the least ratio of the variance of an estimate (sandwich) to (H^-1)_ii.
    """
    told, scatter = np.diag(inverse(at)), np.diag(sandwich(at))
    ratio = np.divide(scatter, told, out=np.full(len(told), np.inf), where=told > 0)
    # A gradient that is zero in every block, as in exact simulations, has no scatter: rounding is the limit.
    ratio = ratio[(ratio > 0) & np.isfinite(ratio)]
    return float(STEP_LEFT**2 * ratio.min(initial=1.0))
