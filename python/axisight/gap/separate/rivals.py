"""Which two causes stay open, and the models that stand for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.experiment import ENOUGH, NAMED, Plan, SeparatingExperiment
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.likelihood import log_ratio
from axisight.gap.search.state import SearchState
from axisight.gap.separate.question import Seen, Turn

Array = NDArray[np.float64]

# An alternative less likely than this is none.
_LIKELY = 0.05


@dataclass(frozen=True, eq=False)
class Rivals:
    """Which of two fitted models is right, that explain the logs by different causes, the last effect of each.

    Each in turn is the machine: its simulated run along a motion is fitted by the other. What that leaves
    is the log-likelihood ratio to expect once the run is among the logs, by the rules of a diagnosis. The
    motion counts for the worse of the two, and for less where it hardly shows that there is a cause.
    ``labels``: of these, ``effect@axis``. Of the logs, by axis: ``samples`` (n_axes,) and what there
    was ``to_explain`` (n_axes,), as a mean square of the weighted residual above the noise.
    ``least``: of that, below which nothing is a cause.
    """

    labels: tuple[str, str]
    models: tuple[FittedModel, FittedModel]
    samples: Array
    to_explain: Array
    least: float

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) they act on; none for effects of the whole arm alone."""
        found = {m.free[-1].effect.axis for m in self.models}
        return tuple(sorted(a for a in found if a is not None))

    @property
    def turns(self) -> tuple[Turn, Turn]:
        """Each of them as the machine; without its last effect, the other explains nothing."""
        one, other = self.models
        return _turn(one, other), _turn(other, one)

    @property
    def enough(self) -> float:
        """The log-likelihood ratio that decides."""
        return ENOUGH

    def worth(self, seen: Sequence[Seen], repeats: int = 1) -> float:
        """Return the log-likelihood ratio to expect, on the axis that shows most, of the worse rival."""
        ratios = []
        for one in seen:
            new = np.full_like(self.samples, repeats * one.samples)
            samples = np.stack([self.samples, new], -1)
            explained = np.stack([self.to_explain, one.there], -1)
            left = np.stack([np.zeros_like(one.left), one.left], -1)
            ratio = log_ratio(left, explained, samples)
            # Beside the new runs the old ones weigh otherwise: what they show now may not show then.
            shown = one.there * new / samples.sum(-1)
            ratios.append(float((ratio * np.minimum(1.0, shown / (NAMED * self.least))).max()))
        return min(ratios)

    def answered(self, plan: Plan, worth: float) -> SeparatingExperiment:
        """Return a planned experiment with its log-likelihood ratio."""
        return SeparatingExperiment(plan, self.labels, worth)


def _turn(machine: FittedModel, other: FittedModel) -> Turn:
    return Turn(machine, other, other.free, other.free[:-1])


def rivals_of(found: SearchState, settings: Settings) -> Rivals | None:
    """Return the two causes of a search that are most nearly as likely; None where all is clear.

    Of every cause, the likeliest rival that is no cause itself, at least one in twenty.
    """
    accepted = {r.trial.label for r, _ in found.accepted}
    open_pairs = [
        (other.probability / max(first.probability, 1e-300), first.trial, other.trial)
        for first, standing in found.accepted
        for other in standing.ranked
        if other.trial.label not in accepted and other.probability >= _LIKELY
    ]
    if not open_pairs:
        return None
    _, first, other = max(open_pairs, key=lambda x: x[0])
    first = _beside_as_many(found, first, other)
    samples = found.layout.samples()
    return Rivals(
        (first.label, other.label),
        (first.fitted, other.fitted),
        samples,
        np.maximum(found.to_explain(), 0.0) / samples,
        settings.smallest_gain,
    )


def _beside_as_many(
    found: SearchState, first: FittedHypothesis, other: FittedHypothesis
) -> FittedHypothesis:
    """Return a cause as it was fitted beside the same others as its rival, which may not have been fitted since."""
    for one in found.rounds:
        for r, _ in one.accepted:
            if r.trial.label == first.label and _others(r.trial) == _others(other):
                return r.trial
    return first


def _others(one: FittedHypothesis) -> set[str]:
    return {f.effect.label for f in one.fitted.free[:-1]}
