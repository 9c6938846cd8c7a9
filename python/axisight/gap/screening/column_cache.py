"""Cache of the sensitivities of candidates from one model of the search to the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel, Hypothesis, NormalEquations

Array = NDArray[np.float64]

_Key = tuple[str, tuple[str, ...], tuple[float, ...]]


class ColumnCache:
    """Sensitivities of candidates with neutral values, on the logs numbered ``logs``.

    A cause that is added to the model changes these sensitivities only a little. They are exact enough to tell, without
    a simulation, which candidates gain nothing on the remaining error.
    """

    def __init__(self) -> None:
        self.logs: list[int] = []
        self._halved = False
        self._rows: dict[_Key, Array] = {}

    def begin(self, logs: Sequence[int], *, halved: bool = False) -> None:
        """Set the logs, or their first halves (``halved``), and clear the cache if it holds other logs."""
        if (list(logs), halved) != (self.logs, self._halved):
            self.logs, self._halved = list(logs), halved
            self._rows.clear()

    def keep(self, option: Hypothesis, found: NormalEquations) -> None:
        """Store the columns of a candidate, which is the last effect of the model of ``found``."""
        last = max((place for place, _ in found.parameters if place is not None), default=None)
        own = [i for i, (place, _) in enumerate(found.parameters) if place == last]
        if [found.parameters[i][1] for i in own] == list(option.free) and found.jacobian:
            self._rows[_key(option)] = np.stack([found.jacobian[i].values for i in own])

    def rows(self, option: Hypothesis) -> Array | None:
        """Return the columns of a candidate (n_parameters, n_residuals); None if they are not in the cache."""
        return self._rows.get(_key(option))


def _key(option: Hypothesis) -> _Key:
    values = option.effect.parameters or {}
    return option.effect.label, option.free, tuple(float(values[n]) for n in sorted(values))


class Bordered:
    """Normal equations of a fitted model that can be extended by the columns of a candidate."""

    def __init__(self, model: FittedModel) -> None:
        self.model = model
        labels = [None if i is None else model.effects[i].label for i, _ in model.parameters]
        names = [name for _, name in model.parameters]
        own = [model.columns[key].values for key in zip(labels, names, strict=True)]
        self._rows = np.stack(own) if own else np.empty((0, len(model.residual)))
        # A block of chaotic motion has no usable derivatives.
        self._followed = np.einsum("bii->b", model.matrix) > 0 if own else model.loss > 0

    def with_candidate(self, option: Hypothesis, new: Array, replaced: set[str]) -> NormalEquations:
        """Return the normal equations of the model with a candidate whose columns are ``new`` (k, n_residuals).

        ``replaced``: the simulator's parameters that the candidate replaces.
        """
        model = self.model
        kept = [
            i
            for i, (place, name) in enumerate(model.parameters)
            if place is not None or name not in replaced
        ]
        n, k = len(kept), len(new)
        matrix, gradient = (
            np.zeros((len(model.loss), n + k, n + k)),
            np.zeros((len(model.loss), n + k)),
        )
        # Most candidates replace no parameter, and a plain slice is cheaper than an index list.
        every = slice(None) if n == len(model.parameters) else kept
        matrix[:, :n, :n] = model.matrix[:, every][:, :, every]
        gradient[:, :n] = model.gradient[:, every]
        # Most candidates act on one axis: their columns are zero in the blocks of the others.
        acts = np.logical_or.reduceat(new.any(axis=0), model.start)
        for block in np.flatnonzero(self._followed & acts):
            rows = slice(model.start[block], model.start[block] + model.size[block])
            here = new[:, rows]
            border = self._rows[:, rows] @ here.T
            matrix[block, :n, n:] = border[kept]
            matrix[block, n:, :n] = border[kept].T
            matrix[block, n:, n:] = here @ here.T
            gradient[block, n:] = here @ model.residual[rows]
        names = tuple(model.parameters[i] for i in kept)
        precision, pull = _priors(option)
        prior = np.zeros((n + k, n + k))
        prior[:n, :n] = model.prior_matrix[np.ix_(kept, kept)]
        prior[n:, n:] = np.diag(precision)
        return NormalEquations(
            parameters=(*names, *((len(model.free), name) for name in option.free)),
            at_bound=tuple(name for name in model.at_bound if name in names),
            matrix=matrix,
            gradient=gradient,
            loss=model.loss,
            prior_matrix=prior,
            prior_gradient=np.concatenate([model.prior_gradient[kept], pull]),
            room={**model.room, **_room(option, len(model.free))},
        )


def _priors(option: Hypothesis) -> tuple[Array, Array]:
    """Return the precisions of a candidate's priors and the prior gradient at its start values, (k,) each."""
    values = option.effect.parameters or {}
    priors = [option.priors.get(name) for name in option.free]
    precision = np.array([0.0 if p is None else p[1] ** -2 for p in priors])
    off = [0.0 if p is None else values[n] - p[0] for n, p in zip(option.free, priors, strict=True)]
    return precision, precision * np.array(off)


def _room(option: Hypothesis, place: int) -> dict[tuple[int | None, str], tuple[float, float]]:
    """Return how far down and up each parameter of a candidate may move from its start value, within its bounds."""
    values = option.effect.parameters or {}
    limits = {name: option.limits(name) for name in option.free}
    return {
        (place, name): (least - values[name], most - values[name])
        for name, (least, most) in limits.items()
    }
