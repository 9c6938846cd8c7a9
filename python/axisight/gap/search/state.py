"""State of a search: the simulator re-fitted, the model with the causes so far, and how each round stood."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.trace import Step
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import held_out_loss, predictable
from axisight.gap.fit.sensitivity import Sensitivity
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.likelihood import FORMULA_ERROR
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

Array = NDArray[np.float64]

OPEN = 1.0
"""Loss that a step may still promise: half of it is a log-likelihood ratio."""


@dataclass(frozen=True)
class Round:
    """One round: how candidates stood on each axis, what was taken in.

    ``left`` (n_axes,): held-out loss above the floor before.
    """

    standings: tuple[AxisPosterior, ...]
    accepted: tuple[tuple[RankedHypothesis, AxisPosterior], ...]
    left: Array


@dataclass
class SearchState:
    """Result of a search.

    ``baseline``: the simulator re-fitted without effects; ``model``: with the
    accepted effects; ``floor`` (n_blocks,): loss of noise alone; ``layout``: where the
    blocks lie; ``skipped``: candidates that failed, with the reason;
    ``sensitivities`` by label, of candidates as they were screened last;
    ``steps``: what each move changed;
    ``adds_up``: errors add up axis by axis; ``by_axis``: the effects explain their axes, not the arm.
    """

    baseline: FittedModel
    model: FittedModel
    floor: Array
    layout: Layout
    rounds: list[Round] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    sensitivities: dict[str, Sensitivity] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    adds_up: bool = False
    by_axis: bool = False

    @property
    def accepted(self) -> list[tuple[RankedHypothesis, AxisPosterior]]:
        """The causes in the model and how they stood when they entered, in the model's order."""
        entered = {r.trial.label: (r, s) for x in self.rounds for r, s in x.accepted}
        return [entered[f.effect.label] for f in self.model.free]

    def moved(self, move: str, model: FittedModel) -> None:
        """Take the model that a move of `axisight.gap.facts.trace.MOVES` makes, and write down what it changed."""
        before, after = (tuple(f.effect.label for f in m.free) for m in (self.model, model))
        self.steps.append(Step(move, before, after, self.model.total, model.total))
        self.model = model

    def judged_again(self, standing: AxisPosterior) -> None:
        """Take how a cause stands beside all others, in the place of how it stood when it came in."""
        self.rounds.append(Round((standing,), ((standing.best, standing),), self.left()))

    def standings_of(self, cause: RankedHypothesis) -> tuple[AxisPosterior, ...]:
        """Return how the round stood in which a cause came in."""
        return next(x.standings for x in self.rounds if any(r is cause for r, _ in x.accepted))

    def to_explain(self) -> Array:
        """Return the held-out loss of the re-fitted simulator above the floor, by axis (n_axes,)."""
        used = predictable(self.model)
        above = held_out_loss(self.baseline, like=self.model) - self.floor
        return self.layout.by_axis(np.where(used, above, 0.0))

    def left(self) -> Array:
        """Return the held-out loss of the model above the floor, by axis (n_axes,)."""
        return self.layout.by_axis(held_out_loss(self.model) - self.floor)

    def counted(self, axis: int | None) -> float:
        """Return what the residuals of an axis (from 0) count for; where that is None of the one that counts least."""
        samples = self.layout.samples()
        return float(samples.min() if axis is None else samples[axis])

    def removed(self) -> Array:
        """Return how much of it the causes remove, by axis (n_axes,)."""
        used = predictable(self.model)
        fall = held_out_loss(self.baseline, like=self.model) - held_out_loss(self.model)
        return self.layout.by_axis(np.where(used, fall, 0.0))

    def least_falls(self, settings: Settings) -> Array:
        """Return the fall of the loss of each axis (n_axes,) below which nothing there is a cause.

        In a loop, where errors do not add up axis by axis, what a cause on one axis takes away
        leaves the error of its formula on every other.
        """
        formulas = 0.0 if self.adds_up else settings.model_error**2 * float(self.removed().sum())
        return np.maximum(
            settings.smallest_gain * self.layout.samples() + formulas,
            settings.smallest_share * self.to_explain(),
        )

    def mends(self, one: FittedHypothesis) -> bool:
        """Whether a trial mends the formula of a cause: it is another law of the same gear, or of its dry friction.

        One that takes away no more on its own axis than what formulas may leave of what was removed there.
        """
        axis = one.hypothesis.effect.axis
        others = [
            e for e in self.model.effects if e.axis == axis and alike(e, one.hypothesis.effect)
        ]
        if self.adds_up or axis is None or not others:
            return False
        fall = self.layout.by_axis(held_out_loss(self.model) - one.held_out)
        return bool(fall[axis - 1] < FORMULA_ERROR * self.removed()[axis - 1])

    def explained(self) -> float:
        """Return the share of the explainable held-out error the model removes."""
        total = float(self.to_explain().sum())
        return float(self.removed().sum()) / total if total > 0 else 0.0


def alike(one: Effect, other: Effect) -> bool:
    """Whether two effects are laws of one gear, or of one dry friction."""
    law = effect_info(one.name).law_of
    return law is not None and law == effect_info(other.name).law_of
