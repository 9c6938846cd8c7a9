"""Adds what joint encoders show to the normal equations of a model: one row for each reading of a gear.

The rows of a log and axis count in all data blocks there, each with an equal part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.gap.fit.fitted_model import FittedModel, NormalEquations
from axisight.gap.fit.rank_deficiency import deviations_seen
from axisight.gap.simulator.gear_readings import GearReadings

Array = NDArray[np.float64]
Key = tuple[int | None, str]


@dataclass(frozen=True)
class GearRows:
    """Rows of a model: weighted errors of its readings (n_readings,), and their slopes (n_readings, n_parameters)."""

    readings: GearReadings
    errors: Array
    slopes: Array

    def fall(self, step: Array) -> float:
        """Return by how much the loss of the rows falls with a step of the parameters (n_parameters,)."""
        return float(np.sum(self.errors**2) - np.sum((self.errors + self.slopes @ step) ** 2))

    def added(
        self, at: NormalEquations, log: NDArray[np.int64], axis: NDArray[np.int64]
    ) -> NormalEquations:
        """Return normal equations with these rows; ``log``, ``axis`` (n_blocks,): those of the blocks, from 0."""
        matrix, gradient, loss = at.matrix.copy(), at.gradient.copy(), at.loss.copy()
        places = zip(self.readings.log.tolist(), self.readings.axis.tolist(), strict=True)
        for number, place in set(places):
            mine = (self.readings.log == number) & (self.readings.axis == place)
            blocks = np.flatnonzero((log == number) & (axis == place))
            if len(blocks):
                share, errors, slopes = 1.0 / len(blocks), self.errors[mine], self.slopes[mine]
                loss[blocks] += share * float(errors @ errors)
                if at.parameters:  # else there are no matrices
                    matrix[blocks] += share * (slopes.T @ slopes)
                    gradient[blocks] += share * (slopes.T @ errors)
        return replace(at, matrix=matrix, gradient=gradient, loss=loss)

    def added_to_fit(self, fitted: FittedModel) -> FittedModel:
        """Return a fitted model with these rows, also in its standard deviations."""
        found = self.added(fitted, fitted.log, fitted.axis)
        assert isinstance(found, FittedModel)
        scatter = fitted.gradient.T @ fitted.gradient + self.slopes.T @ self.slopes
        std = deviations_seen(
            found.matrix.sum(axis=0) + found.prior_matrix, scatter + found.prior_matrix
        )
        return replace(found, std=dict(zip(found.parameters, std.tolist(), strict=True)))


def gear_rows(
    readings: GearReadings,
    parameters: Sequence[Key],
    own: Mapping[str, float],
    effects: Sequence[Effect],
    steps: Sequence[float],
) -> GearRows:
    """Return the rows of a model with the values ``own`` and ``effects``.

    ``parameters``: those of the slopes, own ones with None as their effect; ``steps``: changes for their differences.
    """
    errors = readings.residual(own, effects)
    slopes = np.zeros((len(errors), len(parameters)))
    for column, ((place, name), by) in enumerate(zip(parameters, steps, strict=True)):
        if not readings.feels(name, None if place is None else effects[place]):
            continue
        moved_own, moved = own, list(effects)
        if place is None:
            moved_own = {**own, name: own[name] + by}
        else:
            value = (effects[place].parameters or {})[name]
            moved[place] = effects[place].with_values({name: value + by})
        slopes[:, column] = (readings.residual(moved_own, moved) - errors) / by
    return GearRows(readings, errors, slopes)


def fit_loss(fitted: FittedModel) -> float:
    """Return the loss that a fit minimises, priors included."""
    told = np.diag(fitted.prior_matrix) > 0
    off = fitted.prior_gradient[told] ** 2 / np.diag(fitted.prior_matrix)[told]
    return fitted.total + float(off.sum())
