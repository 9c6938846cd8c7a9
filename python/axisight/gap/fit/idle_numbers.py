"""Numbers of an effect that a fit does not need: they are no cost of the effect that has them.

Orders of a ripple are taken from the residual of the simulator; beside the right one, what is left of it
at neighbouring orders is taken in too. Of a load or a centre of mass one coordinate may be all that a
motion shows, of a tilted base one direction; a balancer mostly stands upright where its axis is at zero.
Of the gains of a cascade one may be another.
An effect is not to pay for what says nothing for it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.fit.fitted_model import FittedModel

Array = NDArray[np.float64]
# Names of numbers that are idle or not together, and for how many they count.
Term = tuple[tuple[str, ...], float]

# Fitted values of a term of a series: cosine, sine and order.
_OF_A_WAVE = 3.0


def idle_numbers(fitted: FittedModel, pays: Callable[[float, float, float], bool]) -> float:
    """Return how many numbers of the last effect do not pay for themselves; one of them always does.

    ``pays``: whether a loss of the second size is that much worse than one of the first, for so many
    numbers. Without some, all other parameters go where they leave least, to second order. What costs
    least goes first.
    """
    last = len(fitted.effects) - 1
    places = {name: i for i, (place, name) in enumerate(fitted.parameters) if place == last}
    terms = _terms(fitted, set(places))
    if not terms:
        return 0.0
    effect = fitted.effects[last]
    # An effect of the arm is seen on every axis.
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

    # Something of it stays: another number, or the term that it needs most.
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
    """Return what may be idle of the last effect: waves of a series, and what is marked so."""
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
    """Return the size of every parameter, and their covariance in these sizes."""
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    spread = np.linalg.inv(matrix / np.outer(size, size) + 1e-9 * np.eye(len(matrix)))
    return size, spread
