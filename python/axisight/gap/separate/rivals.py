"""Selects the two causes that the logs cannot separate, and the models that contain them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.experiment import ENOUGH, NAMED, Plan, SeparatingExperiment
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.ranking.likelihood import log_ratio
from axisight.gap.search.state import SearchState
from axisight.gap.separate.question import Seen, Turn

Array = NDArray[np.float64]

# Smallest probability of a rival.
_LIKELY = 0.05


@dataclass(frozen=True, eq=False)
class Rivals:
    """The question which of two fitted models is right; their last effects are the two rivals.

    Each model in turn is the machine, and its simulated run along a motion is fitted by the other. The error that this
    leaves gives the log-likelihood ratio that a diagnosis with that run would find. A motion counts by the less
    favourable of the two. It counts for less if it hardly shows that there is a cause at all.

    - ``labels``: the rivals, as ``effect@axis``.
    - ``samples`` (n_axes,): number of residuals in the logs.
    - ``to_explain`` (n_axes,): mean square of the weighted residual above the noise in the logs.
    - ``least``: smallest mean square of a cause.
    """

    labels: tuple[str, str]
    models: tuple[FittedModel, FittedModel]
    samples: Array
    to_explain: Array
    least: float

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) that the rivals act on; empty for effects of the whole arm."""
        found = {m.free[-1].effect.axis for m in self.models}
        return tuple(sorted(a for a in found if a is not None))

    @property
    def turns(self) -> tuple[Turn, Turn]:
        """The two truths: each model once as the machine, with the other model fitted to its run."""
        one, other = self.models
        return _turn(one, other), _turn(other, one)

    @property
    def enough(self) -> float:
        """The log-likelihood ratio that decides."""
        return ENOUGH

    def worth(self, seen: Sequence[Seen], repeats: int = 1) -> float:
        """Return the expected log-likelihood ratio on the axis that shows most, for the less favourable rival."""
        ratios = []
        for one in seen:
            new = np.full_like(self.samples, repeats * one.samples)
            samples = np.stack([self.samples, new], -1)
            explained = np.stack([self.to_explain, one.there], -1)
            left = np.stack([np.zeros_like(one.left), one.left], -1)
            ratio = log_ratio(left, explained, samples)
            # New runs reduce the weight of the old logs. A cause that shows in these may show no more in all logs
            # together.
            shown = one.there * new / samples.sum(-1)
            ratios.append(float((ratio * np.minimum(1.0, shown / (NAMED * self.least))).max()))
        return min(ratios)

    def answered(self, plan: Plan, worth: float) -> SeparatingExperiment:
        """Return a planned experiment with its log-likelihood ratio."""
        return SeparatingExperiment(plan, self.labels, worth)


def _turn(machine: FittedModel, other: FittedModel) -> Turn:
    return Turn(machine, other, other.free, other.free[:-1])


def rivals_of(found: SearchState, settings: Settings) -> Rivals | None:
    """Return the cause and the rival with the most similar probabilities; None if no cause has a rival.

    A rival is no cause itself and has a probability of at least 5 %.
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
    samples = found.layout.samples()
    return Rivals(
        (first.label, other.label),
        (first.fitted, other.fitted),
        samples,
        np.maximum(found.to_explain(), 0.0) / samples,
        settings.smallest_gain,
    )
