"""Sensitivity of the loss to an effect that the model lacks, from the normal equations of one evaluation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.fit.fitted_model import Hypothesis, NormalEquations
from axisight.gap.fit.held_out import linear_step, predicted_loss

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of the loss to one amplitude of a candidate, the first that no simpler law has.

    Amplitudes shared with a simpler law may compensate for it; all other parameters of the candidate stay neutral.
    ``rest``: normal equations of all other parameters, one block per axis, for a missing amplitude of one. ``more``:
    factor on the amount of data.
    """

    option: Hypothesis
    parameter: str
    rest: NormalEquations
    more: float = 1.0

    def scaled(self, factor: float) -> Sensitivity:
        """Return the sensitivity for ``factor`` times as much data."""
        return replace(self, more=factor * self.more)

    def unfitted(self, amplitude: float) -> Array:
        """Return the loss on each axis (n_axes,) of a missing amplitude, without any compensation."""
        return np.asarray(self.more * amplitude**2 * self.rest.loss)

    def losses(self, amplitude: float) -> Array:
        """Return the loss on each axis (n_axes,) that a missing amplitude leaves after the other parameters compensate.

        The simulator's own parameters compensate within their bounds.
        """
        lacking = replace(
            self.rest, gradient=amplitude * self.rest.gradient, loss=amplitude**2 * self.rest.loss
        )
        every = np.ones(len(lacking.loss), dtype=bool)
        left = predicted_loss(lacking, every, linear_step(lacking))
        return np.asarray(self.more * np.maximum(left, 0.0))


def sensitivity(
    option: Hypothesis, fitted: NormalEquations, axis: NDArray[np.int64]
) -> Sensitivity | None:
    """Return the sensitivity of a candidate without influence at its start values; None for any other.

    ``fitted``: the model with the candidate as its last effect; ``axis`` (n_blocks,): axis of each block.
    """
    info = effect_info(option.effect.name)
    sizes = {p.name for p in info.parameters if p.role == "amplitude"}
    plainer = {p.name for law in info.contains for p in effect_info(law).parameters}
    free = sorted((n for n in option.free if n in sizes), key=lambda n: n in plainer)
    name = free[0] if free else None
    last = max((place for place, _ in fitted.parameters if place is not None), default=None)
    if option.effect.acts or name is None or (last, name) not in fitted.parameters:
        return None
    column = fitted.parameters.index((last, name))
    shared = {(last, n) for n in free[1:] if n in plainer and name not in plainer}
    rest = [i for i, key in enumerate(fitted.parameters) if key[0] != last or key in shared]
    names = tuple(fitted.parameters[i] for i in rest)
    axes = range(int(axis.max()) + 1)
    by_axis = np.stack([fitted.matrix[axis == i].sum(axis=0) for i in axes])
    # The prior gradient of the present fit is not caused by the missing effect.
    return Sensitivity(
        option,
        name,
        NormalEquations(
            parameters=names,
            at_bound=(),
            matrix=by_axis[:, rest][:, :, rest],
            gradient=by_axis[:, rest, column],
            loss=by_axis[:, column, column],
            prior_matrix=fitted.prior_matrix[np.ix_(rest, rest)],
            prior_gradient=np.zeros(len(rest)),
        ),
    )
