"""Counts the parameters of an effect that do not pay for themselves, so that the effect is not charged for them.

This happens in several cases:

- Ripple orders come from the residual; beside the right order, its neighbours are fitted, too.
- A motion may show only one coordinate of a payload or a centre of mass, or one direction of a base tilt.
- A gravity balancer is mostly upright where its axis is at zero.
- Only one gain of a cascade may be wrong.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.fit.fitted_model import FittedModel

Array = NDArray[np.float64]
# Names of parameters that can only be idle together, and their number in the cost.
Term = tuple[tuple[str, ...], float]

# Fitted values of a term of a series: cosine, sine and order.
_OF_A_WAVE = 3.0


def idle_numbers(fitted: FittedModel, pays: Callable[[float, float, float], bool]) -> float:
    """Return how many parameters of the last effect do not pay for themselves; at least one always does.

    ``pays(loss, more, count)``: whether ``count`` parameters are worth the fall from the loss ``more`` to ``loss``.
    Terms are removed one after another, the cheapest first. For each, all other parameters move to their new minimum,
    to second order.
    """
    last = len(fitted.effects) - 1
    places = {name: i for i, (place, name) in enumerate(fitted.parameters) if place == last}
    terms = _terms(fitted, set(places))
    if not terms:
        return 0.0
    effect = fitted.effects[last]
    # An effect of the whole arm is judged on all axes.
    here = np.ones(len(fitted.axis), dtype=bool)
    if effect.axis is not None:
        here = fitted.axis == effect.axis - 1
    loss = float(fitted.loss[here].sum())
    size, spread = _spread(fitted)
    values = effect.parameters or {}

    def worse(gone: list[str]) -> float:
        at = [places[name] for name in gone]
        theta = np.array([values[name] for name in gone]) * size[at]
        return float(theta @ np.linalg.solve(spread[np.ix_(at, at)], theta))

    # At least one term stays if all free parameters belong to terms.
    most = len(terms) - (len(places) == sum(len(names) for names, _ in terms))
    gone: list[str] = []
    idle = 0.0
    for _ in range(most):
        names, count = min(terms, key=lambda t: worse([*gone, *t[0]]))
        if pays(loss, loss + worse([*gone, *names]), idle + count):
            break
        terms.remove((names, count))
        gone += names
        idle += count
    return idle


def _terms(fitted: FittedModel, free: set[str]) -> list[Term]:
    """Return the terms of the last effect that may be idle: waves of a series, and parameters marked as optional."""
    effect = fitted.effects[-1]
    info, values = effect_info(effect.name), effect.parameters or {}
    waves: list[Term] = [
        ((cosine, sine), _OF_A_WAVE)
        for order, cosine, sine in info.terms().values()
        if values.get(order) and cosine in free and sine in free
    ]
    single: list[Term] = [((name,), 1.0) for name in info.marked("optional") if name in free]
    return [*waves, *single]


def _spread(fitted: FittedModel) -> tuple[Array, Array]:
    """Return the scale of every parameter (n_parameters,) and the covariance in these scales."""
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    spread = np.linalg.inv(matrix / np.outer(size, size) + 1e-9 * np.eye(len(matrix)))
    return size, spread
