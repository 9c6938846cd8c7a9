"""The price of own parameters that a fit bends away from their nominal values [nats].

A fit counts every sample as independent, so it moves masses and stiffnesses for errors that neighbouring samples
share. The belief counts far fewer independent samples. With its weights, a bent parameter may either return at the
cost of some likelihood, or stay and pay its prior. The price is the cheaper of both.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.rank_deficiency import pseudo_inverse

Array = NDArray[np.float64]


def price_of_bending(fitted: FittedModel, weight: Array) -> float:
    """Return the least price of the priors and of the data, weighed as the belief weighs them [nats].

    Half of ``min_s chi2(s) + sum_b weight_b (2 g_b s + s M_b s)`` over steps s from the end of the fit. chi2 is that of
    the own parameters' priors; the sum is the loss of each block to second order. ``weight`` (n_blocks,): nats in the
    belief for one nat of the fit.
    """
    kept = _KEPT.setdefault(fitted, {})
    key = weight.tobytes()
    if key not in kept:
        kept[key] = _price(fitted, weight)
    return kept[key]


# Prices by model and weights, since axes and refinements ask for the same ones many times.
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
