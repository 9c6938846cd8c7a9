"""A hypothesis fitted on top of a model, with its held-out loss and what its numbers cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.idle_numbers import idle_numbers
from axisight.gap.ranking.likelihood import likelier

Array = NDArray[np.float64]


def numbers(effect: Hypothesis) -> float:
    """Return the number of fitted values of an effect. The order of a harmonic counts as one.

    The side of a gear on which an effect acts is a place and costs nothing, like the axis.
    """
    harmonics = sum(name.startswith("cosine_") and name[7].isdigit() for name in effect.free)
    places = effect_info(effect.effect.name).marked("place")
    return float(len(effect.free) + harmonics - len({*places} & {*effect.free}))


@dataclass(frozen=True)
class FittedHypothesis:
    """A hypothesis fitted together with the effects of a model.

    ``held_out`` (n_blocks,): its held-out loss by block; ``idle``: how many of its numbers the fit does not need;
    ``also``: further effects that are tried together with it.
    """

    hypothesis: Hypothesis
    fitted: FittedModel
    held_out: Array
    idle: float = 0.0
    also: tuple[Hypothesis, ...] = ()

    @property
    def label(self) -> str:
        """``effect@axis``, of several with a plus between them."""
        return " + ".join(h.effect.label for h in (*self.also, self.hypothesis))

    @property
    def cost(self) -> float:
        """Number of fitted values that it needs. The order of a harmonic counts as one."""
        return sum(map(numbers, (*self.also, self.hypothesis))) - self.idle


def trial(
    hypothesis: Hypothesis, fitted: FittedModel, model: FittedModel | None = None
) -> FittedHypothesis:
    """Return a fitted hypothesis with its held-out loss.

    ``model``: the model without it. If the two are scored on different folds of the data, the difference that
    the folds make for ``model`` is added, so that both losses compare.
    """

    def pays(loss: float, without: float, count: float) -> bool:
        return likelier(loss, count, than=(without, 0.0))

    held_out = held_out_loss(fitted)
    if model is not None:
        held_out = held_out + _left_out_otherwise(model, fitted)
    return FittedHypothesis(hypothesis, fitted, held_out, idle_numbers(fitted, pays))


def _left_out_otherwise(model: FittedModel, fitted: FittedModel) -> Array:
    """Return by how much the loss of ``model`` rises with its own folds against those of ``fitted`` (n_blocks,).

    Zero on axes where it falls: there the gap itself misleads the own parameters, and a fit with the cause does not
    have that error.
    """
    more = held_out_loss(model) - held_out_loss(model, like=fitted)
    on_axis = np.bincount(model.axis, more)[model.axis]
    return np.asarray(np.where(on_axis > 0, more, 0.0))


def falls(trials: Sequence[FittedHypothesis], current: Array, layout: Layout) -> Array:
    """Return the fall of the held-out loss by trial and axis, (n_trials, n_axes)."""
    return np.array([layout.by_axis(current - t.held_out) for t in trials]).reshape(
        len(trials), layout.n_axes
    )


def are_lags(one: FittedHypothesis, other: FittedHypothesis) -> bool:
    """Whether both are delays or lags of one axis."""
    effects = one.hypothesis.effect, other.hypothesis.effect
    late = all(effect_info(e.name).late for e in effects)
    return late and effects[0].axis == effects[1].axis
