"""The question that an experiment is to answer, and what a motion shows about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.experiment import Experiment, Plan
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Turn:
    """One possible truth: ``machine`` is the true model, and ``other`` is the model that is fitted to its run.

    ``free``: fitted effects of the other model; ``neither``: those without the effects in question.
    """

    machine: FittedModel
    other: FittedModel
    free: tuple[Hypothesis, ...]
    neither: tuple[Hypothesis, ...]


@dataclass(frozen=True, eq=False)
class Seen:
    """What a motion shows about a truth: mean squares (n_axes,) of the residual of one run.

    ``left``: with the other model fitted. ``there``: without the effects in question. ``samples``: number of
    residuals of an axis.
    """

    left: Array
    there: Array
    samples: float


class Question(Protocol):
    """The question that an experiment is to answer."""

    @property
    def turns(self) -> Sequence[Turn]:
        """The possible truths, each with the model that the experiment must tell from it."""

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) that the question is about; empty for the whole arm."""

    @property
    def enough(self) -> float:
        """The worth at which a motion answers the question."""

    def worth(self, seen: Sequence[Seen], repeats: int = 1) -> float:
        """Return the worth of a motion with this many runs, from what it shows for each possible truth."""

    def narrowed(self, seen: Sequence[Sequence[Seen]], repeats: int) -> Self:
        """Return the part of the question that one of the motions answers in ``repeats`` runs; all if none does."""

    def answered(self, plan: Plan, worth: float) -> Experiment:
        """Return the planned experiment with its worth."""
