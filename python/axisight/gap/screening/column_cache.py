"""What candidates do to the error, kept from one model for those after it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel, Hypothesis, NormalEquations

Array = NDArray[np.float64]

_Key = tuple[str, tuple[str, ...], tuple[float, ...]]


class ColumnCache:
    """Derivatives of the error by candidates that do nothing as they are, on the logs ``logs``.

    Causes that a model takes in bend them as far as it changes: enough to tell which candidates
    promise anything on what is left, without a run.
    """

    def __init__(self) -> None:
        self.logs: list[int] = []
        self._halved = False
        self._rows: dict[_Key, Array] = {}

    def begin(self, logs: Sequence[int], *, halved: bool = False) -> None:
        """Get ready for some logs, or the first halves of them; what is known of others is of no use."""
        if (list(logs), halved) != (self.logs, self._halved):
            self.logs, self._halved = list(logs), halved
            self._rows.clear()

    def keep(self, option: Hypothesis, found: NormalEquations) -> None:
        """Keep the columns of a candidate, the last effect of a model."""
        last = max((place for place, _ in found.parameters if place is not None), default=None)
        own = [i for i, (place, _) in enumerate(found.parameters) if place == last]
        if [found.parameters[i][1] for i in own] == list(option.free) and found.jacobian:
            self._rows[_key(option)] = np.stack([found.jacobian[i].values for i in own])

    def rows(self, option: Hypothesis) -> Array | None:
        """Return the columns of a candidate (n_parameters, n_residuals); None where not known."""
        return self._rows.get(_key(option))


def _key(option: Hypothesis) -> _Key:
    values = option.effect.parameters or {}
    return option.effect.label, option.free, tuple(float(values[n]) for n in sorted(values))


class Bordered:
    """Normal equations of a fitted model, to which columns of candidates are put."""

    def __init__(self, model: FittedModel) -> None:
        self.model = model
        labels = [None if i is None else model.effects[i].label for i, _ in model.parameters]
        names = [name for _, name in model.parameters]
        own = [model.columns[key].values for key in zip(labels, names, strict=True)]
        self._rows = np.stack(own) if own else np.empty((0, len(model.residual)))
        # A block that is beyond what a model follows has no derivatives.
        self._followed = np.einsum("bii->b", model.matrix) > 0 if own else model.loss > 0

    def with_candidate(self, option: Hypothesis, new: Array, replaced: set[str]) -> NormalEquations:
        """Return the model with a candidate of which the columns are ``new`` (k, n_residuals).

        ``replaced``: parameters of the simulator that it stands in for.
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
        # Most candidates stand in for nothing, and a plain copy costs a fraction of a selection.
        every = slice(None) if n == len(model.parameters) else kept
        matrix[:, :n, :n] = model.matrix[:, every][:, :, every]
        gradient[:, :n] = model.gradient[:, every]
        for block in np.flatnonzero(self._followed):
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
    """Return the precision of a candidate's priors and what they pull at its start values."""
    values = option.effect.parameters or {}
    priors = [option.priors.get(name) for name in option.free]
    precision = np.array([0.0 if p is None else p[1] ** -2 for p in priors])
    off = [0.0 if p is None else values[n] - p[0] for n, p in zip(option.free, priors, strict=True)]
    return precision, precision * np.array(off)


def _room(option: Hypothesis, place: int) -> dict[tuple[int | None, str], tuple[float, float]]:
    """Return how far down and up a candidate's parameters may go from its start values."""
    values = option.effect.parameters or {}
    limits = {name: option.limits(name) for name in option.free}
    return {
        (place, name): (least - values[name], most - values[name])
        for name, (least, most) in limits.items()
    }
