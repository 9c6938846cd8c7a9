"""What an experiment is to answer, and what a motion would tell about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.experiment import Experiment, Plan
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Turn:
    """One thing that may be so: ``machine`` is the machine, and ``other`` a model that is fitted to it.

    ``free``: effects of the other model that are fitted; ``neither``: those with which nothing is
    explained that is asked about.
    """

    machine: FittedModel
    other: FittedModel
    free: tuple[Hypothesis, ...]
    neither: tuple[Hypothesis, ...]


@dataclass(frozen=True, eq=False)
class Seen:
    """What the other model leaves of a run and what there is to explain, mean squares (n_axes,) each.

    ``samples``: residuals of an axis.
    """

    left: Array
    there: Array
    samples: float


class Question(Protocol):
    """What an experiment is to answer."""

    @property
    def turns(self) -> Sequence[Turn]:
        """What may be so, each to be told from its other model."""

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) it is about; none if about the whole arm alone."""

    @property
    def enough(self) -> float:
        """The worth that answers it."""

    def worth(self, seen: Sequence[Seen], repeats: int = 1) -> float:
        """Return what a motion that is run so often is worth, from what is ``seen`` of each turn."""

    def answered(self, plan: Plan, worth: float) -> Experiment:
        """Return a planned experiment with what it is worth."""
