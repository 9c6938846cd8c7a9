"""The model of a verdict with fresh sensitivities at its final values."""

from __future__ import annotations

from copy import copy

import numpy as np

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.work_count import WorkCount
from axisight.gap.search.balanced_values import inflation


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
    """Return a model with normal equations at its final values; as it is if it cannot be simulated there.

    ``fitter``: that of `own_fitter`.
    """
    found = fitter.fit(model.free, model, fresh=True, max_iterations=0)
    return model if isinstance(found, Diverged) else found
