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
    """Return the number of fitted values of an effect; the order of a harmonic counts too.

    On which side of a gear it acts is a place, which counts no more than the axis does.
    """
    harmonics = sum(name.startswith("cosine_") and name[7].isdigit() for name in effect.free)
    places = effect_info(effect.effect.name).marked("place")
    return float(len(effect.free) + harmonics - len({*places} & {*effect.free}))


@dataclass(frozen=True)
class FittedHypothesis:
    """A candidate fitted on top of a model: its held-out loss by block, (n_blocks,).

    ``idle``: numbers of it that it does not need; ``also``: effects that are under trial together with it.
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
        """Number of fitted values that it needs; the order of a harmonic counts too."""
        return sum(map(numbers, (*self.also, self.hypothesis))) - self.idle


def trial(
    hypothesis: Hypothesis, fitted: FittedModel, model: FittedModel | None = None
) -> FittedHypothesis:
    """Score a fitted candidate on held-out data.

    ``model``: without it, on top of which it is judged. Where parts of the data are left out otherwise than
    of that alone, what it lowers the loss by is counted with these.
    """

    def pays(loss: float, without: float, count: float) -> bool:
        return likelier(loss, count, than=(without, 0.0))

    held_out = held_out_loss(fitted)
    if model is not None:
        held_out = held_out + _left_out_otherwise(model, fitted)
    return FittedHypothesis(hypothesis, fitted, held_out, idle_numbers(fitted, pays))


def _left_out_otherwise(model: FittedModel, fitted: FittedModel) -> Array:
    """Return what parameters of the simulator add to the loss of each block where logs are left out as of ``model``.

    Beyond what they do as of ``evidence``. Where they add less on an axis, it is the gap that misleads them, and
    that a fit with its cause no longer has.
    """
    more = held_out_loss(model) - held_out_loss(model, like=fitted)
    on_axis = np.bincount(model.axis, more)[model.axis]
    return np.asarray(np.where(on_axis > 0, more, 0.0))


def falls(trials: Sequence[FittedHypothesis], current: Array, layout: Layout) -> Array:
    """Return by how much each trial lowers the held-out loss of each axis, (n_trials, n_axes)."""
    return np.array([layout.by_axis(current - t.held_out) for t in trials]).reshape(
        len(trials), layout.n_axes
    )


def are_lags(one: FittedHypothesis, other: FittedHypothesis) -> bool:
    """Whether both are delays or lags of one axis."""
    effects = one.hypothesis.effect, other.hypothesis.effect
    late = all(effect_info(e.name).late for e in effects)
    return late and effects[0].axis == effects[1].axis
