"""State of a search: the re-fitted simulator, the model with the causes so far, and the posteriors of each round."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.facts.axis_names import at_floor
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.trace import Step, Stop
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import held_out_loss, predictable
from axisight.gap.fit.sensitivity import Sensitivity
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.likelihood import FORMULA_ERROR
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening.free_bodies import FreeBodies

Array = NDArray[np.float64]

OPEN = 1.0
"""Loss that a step may still promise: half of it is a log-likelihood ratio."""


@dataclass(frozen=True)
class Round:
    """One round: the posteriors of the axes, and the causes that were added, each with its posterior.

    ``left`` (n_axes,): held-out loss above the floor before the round.
    """

    standings: tuple[AxisPosterior, ...]
    accepted: tuple[tuple[RankedHypothesis, AxisPosterior], ...]
    left: Array


@dataclass
class SearchState:
    """State and result of a search.

    - ``baseline``: the re-fitted simulator without effects; ``model``: with the causes so far.
    - ``floor`` (n_blocks,): the loss of noise alone; ``layout``: axis, log and time of each block.
    - ``skipped``: candidates that failed, with the reason.
    - ``sensitivities`` by label, from the last screening of each candidate.
    - ``steps``: what each move changed.
    - ``number``: the round that is under way, from 1.
    - ``stopped``: where the time limit ended the search; None if it ended by itself.
    - ``noise`` (n_axes,): factor on the estimated noise [1]; below one where `refute_floor` lowered the floor.
    - ``bodies``: the bodies of the arm, where they are not trusted.
    - ``adds_up``: whether the errors of the axes add up; ``by_axis``: whether causes explain single axes, not the arm.
    """

    baseline: FittedModel
    model: FittedModel
    floor: Array
    layout: Layout
    rounds: list[Round] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    sensitivities: dict[str, Sensitivity] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    number: int = 1
    stopped: Stop | None = None
    adds_up: bool = False
    by_axis: bool = False
    noise: Array = field(default_factory=lambda: np.ones(1))
    bodies: FreeBodies | None = None

    @property
    def accepted(self) -> list[tuple[RankedHypothesis, AxisPosterior]]:
        """The causes in the model, each with its latest posterior, in the model's order."""
        entered = {r.trial.label: (r, s) for x in self.rounds for r, s in x.accepted}
        return [entered[f.effect.label] for f in self.model.free]

    def refute_floor(self) -> None:
        """Lower the floor of the judged axes where the model leaves less than it on data left out of the fit.

        No model predicts noise, so what it leaves there is the larger of the two.
        """
        least = self.layout.by_axis(self.floor)
        left = self.layout.by_axis(held_out_loss(self.model))
        share = np.maximum(left, 0.0) / np.maximum(least, 1e-300)
        stands = [at_floor(f, x) for f, x in zip(np.sqrt(least), np.sqrt(left), strict=True)]
        share[stands] = 1.0
        share[~np.isfinite(share)] = 1.0
        share[list(self.layout.silent)] = 1.0
        self.floor = self.floor * share[self.layout.axis]
        self.noise = self.noise * np.sqrt(share)

    def moved(self, move: str, model: FittedModel) -> None:
        """Take the model that a move of `axisight.gap.facts.trace.MOVES` makes, and record what it changed."""
        before, after = (tuple(f.effect.label for f in m.free) for m in (self.model, model))
        self.steps.append(Step(move, before, after, self.model.total, model.total))
        self.model = model

    def standings_of(self, cause: RankedHypothesis) -> tuple[AxisPosterior, ...]:
        """Return the posteriors of the round in which a cause was added."""
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
        """Return the number of samples that an axis (from 0) counts for; for None that of the smallest axis."""
        samples = self.layout.samples()
        return float(samples.min() if axis is None else samples[axis])

    def removed(self) -> Array:
        """Return the held-out loss that the causes remove, by axis (n_axes,)."""
        used = predictable(self.model)
        fall = held_out_loss(self.baseline, like=self.model) - held_out_loss(self.model)
        return self.layout.by_axis(np.where(used, fall, 0.0))

    def least_falls(self, settings: Settings) -> Array:
        """Return the least fall of the loss of each axis (n_axes,) for a cause.

        In closed loop it includes the formula error of all causes so far, since an error on one axis shows on all.
        """
        formulas = 0.0 if self.adds_up else settings.model_error**2 * float(self.removed().sum())
        return np.maximum(
            settings.smallest_gain * self.layout.samples() + formulas,
            settings.smallest_share * self.to_explain(),
        )

    def mends(self, one: FittedHypothesis) -> bool:
        """Whether a trial only corrects the formula of a cause: another law of the same gear or dry friction.

        It removes no more on its own axis than the formula error of the loss already removed there.
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
