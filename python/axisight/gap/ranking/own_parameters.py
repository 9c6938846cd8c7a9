"""What the simulator's own parameters pay for being bent: their prior, as far as the data hold them there.

A fit weighs every sample, and takes masses and stiffnesses along by what neighbouring errors share. The belief
weighs far fewer independent ones. By its weights bent parameters may go back, where hardly anything is lost by
that; where much is, they stay and their prior counts. The cheaper of both is the price.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.rank_deficiency import pseudo_inverse

Array = NDArray[np.float64]


def price_of_bending(fitted: FittedModel, weight: Array) -> float:
    """Return the least of what priors, and data as the belief weighs them, say against a model [nats].

    Half of ``min_s chi2(s) + sum_b weight_b (2 g_b s + s M_b s)`` over steps s from where the fit ended: chi2 of the
    priors, and the loss of each block to second order. ``weight`` (n_blocks,): nats of the belief for each of
    those of the fit.
    """
    precision = np.diag(fitted.prior_matrix)
    told = precision > 0
    off = float((fitted.prior_gradient[told] ** 2 / precision[told]).sum())
    influence = np.einsum("bii->i", fitted.matrix)
    free = np.array([name not in fitted.at_bound for name in fitted.parameters], dtype=bool)
    free |= np.array([place is None for place, _ in fitted.parameters], dtype=bool)
    free &= influence + precision > 0
    pick = np.ix_(free, free)
    matrix = np.tensordot(weight, fitted.matrix, 1) + fitted.prior_matrix
    pull = (weight @ fitted.gradient + fitted.prior_gradient)[free]
    return max(0.5 * (off - float(pull @ pseudo_inverse(matrix[pick]) @ pull)), 0.0)
