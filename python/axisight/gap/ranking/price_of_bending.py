"""What the simulator's own parameters pay for being bent: their prior, as far as the data hold them there.

A fit weighs every sample, and takes masses and stiffnesses along by what neighbouring errors share. The belief
weighs far fewer independent ones. By its weights bent parameters may go back, where hardly anything is lost by
that; where much is, they stay and their prior counts. The cheaper of both is the price.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.rank_deficiency import pseudo_inverse

Array = NDArray[np.float64]


def price_of_bending(fitted: FittedModel, weight: Array) -> float:
    """Return the least of what priors, and data as the belief weighs them, say against a model [nats].

    Half of ``min_s chi2(s) + sum_b weight_b (2 g_b s + s M_b s)`` over steps s from where the fit ended: chi2 of the
    priors of own parameters, and the loss of each block to second order. ``weight`` (n_blocks,): nats of the belief
    for each of those of the fit.
    """
    kept = _KEPT.setdefault(fitted, {})
    key = weight.tobytes()
    if key not in kept:
        kept[key] = _price(fitted, weight)
    return kept[key]


# Prices of models by weights: axes and rounds of refinement ask for them again and again.
_KEPT: WeakKeyDictionary[FittedModel, dict[bytes, float]] = WeakKeyDictionary()


def _price(fitted: FittedModel, weight: Array) -> float:
    own = np.array([place is None for place, _ in fitted.parameters], dtype=bool)
    precision = np.where(own, np.diag(fitted.prior_matrix), 0.0)
    gradient = np.where(precision > 0, fitted.prior_gradient, 0.0)
    off = float((gradient**2 / np.where(precision > 0, precision, 1.0)).sum())
    free = own | np.array([name not in fitted.at_bound for name in fitted.parameters], dtype=bool)
    free &= np.einsum("bii->i", fitted.matrix) + precision > 0
    matrix = np.tensordot(weight, fitted.matrix, 1) + np.diag(precision)
    pull = (weight @ fitted.gradient + gradient)[free]
    gained = float(pull @ pseudo_inverse(matrix[np.ix_(free, free)]) @ pull)
    return max(0.5 * (off - gained), 0.0)
