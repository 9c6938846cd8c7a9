"""Terms of a series that a fit does not need: they are no cost of the effect that has them.

Orders of a ripple are taken from the residual of the simulator; beside the right one, what is left of it
at neighbouring orders is taken in too. An effect is not to pay for what says nothing for it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from axisight.effects import effect_info
from axisight.gap.evidence import Evidence


def idle_terms(evidence: Evidence, pays: Callable[[float, float], bool]) -> int:
    """Return how many terms of the last effect's series do not pay for themselves; one always does.

    ``pays``: whether a loss of the second size is that much worse than one of the first. Without a term
    all other parameters go where they leave least, to second order.
    """
    last = len(evidence.effects) - 1
    effect = evidence.effects[last]
    values = effect.parameters or {}
    places = {name: i for i, (place, name) in enumerate(evidence.parameters) if place == last}
    terms = [
        (places[cosine], places[sine])
        for order, cosine, sine in effect_info(effect.name).terms().values()
        if values.get(order) and cosine in places and sine in places
    ]
    if len(terms) < 2:
        return 0
    matrix = evidence.matrix.sum(axis=0) + evidence.prior_matrix
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    spread = np.linalg.inv(matrix / np.outer(size, size) + 1e-9 * np.eye(len(matrix)))
    here = evidence.axis == (effect.axis or 1) - 1
    loss = float(evidence.loss[here].sum())
    idle = 0
    for term in terms:
        pair = list(term)
        theta = np.array([values[evidence.parameters[i][1]] for i in pair]) * size[pair]
        worse = float(theta @ np.linalg.solve(spread[np.ix_(pair, pair)], theta))
        idle += not pays(loss, loss + worse)
    return min(idle, len(terms) - 1)
