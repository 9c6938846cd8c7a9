"""Selects the causes that the logs cannot separate, and the models that contain them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

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


# Log-likelihood ratio of a motion for a pair that it shows nothing of.
_NOTHING = 0.0


@dataclass(frozen=True, eq=False)
class Rivals:
    """The question which of some fitted models is right; their last effects are the rivals.

    Each model in turn is the machine, and its simulated run along a motion is fitted by each other one. The error that
    this leaves gives the log-likelihood ratio that a diagnosis with that run would find. A motion counts by the least
    favourable pair. It counts for less if it hardly shows that there is a cause at all.

    - ``labels``: the rivals, as ``effect@axis``.
    - ``samples`` (n_axes,): number of residuals in the logs.
    - ``to_explain`` (n_axes,): mean square of the weighted residual above the noise in the logs.
    - ``least``: smallest mean square of a cause.
    - ``alike``: pairs of positions that the motion need not tell apart; they do not count.
    """

    labels: tuple[str, ...]
    models: tuple[FittedModel, ...]
    samples: Array
    to_explain: Array
    least: float
    alike: frozenset[frozenset[int]] = frozenset()

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) that the rivals act on; empty for effects of the whole arm."""
        found = {m.free[-1].effect.axis for m in self.models}
        return tuple(sorted(a for a in found if a is not None))

    @property
    def _pairs(self) -> list[tuple[int, int]]:
        return list(permutations(range(len(self.models)), 2))

    @property
    def turns(self) -> list[Turn]:
        """The truths: each model as the machine, with each other model fitted to its run."""
        return [_turn(self.models[a], self.models[b]) for a, b in self._pairs]

    @property
    def enough(self) -> float:
        """The log-likelihood ratio that decides."""
        return ENOUGH

    def worth(self, seen: Sequence[Seen], repeats: int = 1) -> float:
        """Return the expected log-likelihood ratio on the axis that shows most, for the least favourable pair."""
        ratios = [
            self._ratio(one, repeats)
            for one, pair in zip(seen, self._pairs, strict=True)
            if frozenset(pair) not in self.alike
        ]
        return min(ratios, default=_NOTHING)

    def _ratio(self, one: Seen, repeats: int) -> float:
        new = np.full_like(self.samples, repeats * one.samples)
        samples = np.stack([self.samples, new], -1)
        explained = np.stack([self.to_explain, one.there], -1)
        left = np.stack([np.zeros_like(one.left), one.left], -1)
        ratio = log_ratio(left, explained, samples)
        # New runs reduce the weight of the old logs. A cause that shows in these may show no more in all logs together.
        shown = one.there * new / samples.sum(-1)
        return float((ratio * np.minimum(1.0, shown / (NAMED * self.least))).max())

    def narrowed(self, seen: Sequence[Sequence[Seen]], repeats: int) -> Rivals:
        """Return the question with as many pairs as one of the motions decides in ``repeats`` runs.

        The pair that is hardest to decide goes first. If no motion decides any pair, all of them stay.
        """
        pairs = [frozenset(pair) for pair in self._pairs]
        left = sorted(set(pairs) - self.alike, key=sorted)
        ratio = {
            pair: [
                min(self._ratio(motion[k], repeats) for k, p in enumerate(pairs) if p == pair)
                for motion in seen
            ]
            for pair in left
        }
        while left and max(map(min, zip(*(ratio[p] for p in left), strict=True))) < ENOUGH:
            left.remove(min(left, key=lambda p: max(ratio[p])))
        return replace(self, alike=frozenset(pairs) - frozenset(left)) if left else self

    def answered(self, plan: Plan, worth: float) -> SeparatingExperiment:
        """Return a planned experiment with its log-likelihood ratio."""
        alike = [tuple(self.labels[k] for k in sorted(pair)) for pair in self.alike]
        return SeparatingExperiment(plan, self.labels, worth, tuple(sorted(alike)))


def _turn(machine: FittedModel, other: FittedModel) -> Turn:
    return Turn(machine, other, other.free, other.free[:-1])


def rivals_of(found: SearchState, settings: Settings, most: int) -> Rivals | None:
    """Return a cause and its rivals, at most ``most`` hypotheses; None if no cause has a rival.

    The cause is the one with the rival of the most similar probability. A rival is no cause itself and has a
    probability of at least 5 %; the most probable come first.
    """
    accepted = {r.trial.label for r, _ in found.accepted}
    open_causes = []
    for first, standing in found.accepted:
        others = [
            other
            for other in standing.ranked
            if other.trial.label not in accepted and other.probability >= _LIKELY
        ]
        if others:
            others.sort(key=lambda other: -other.probability)
            ratio = others[0].probability / max(first.probability, 1e-300)
            open_causes.append((ratio, [first, *others[: most - 1]]))
    if not open_causes:
        return None
    _, ranked = max(open_causes, key=lambda x: x[0])
    samples = found.layout.samples()
    return Rivals(
        tuple(r.trial.label for r in ranked),
        tuple(r.trial.fitted for r in ranked),
        samples,
        np.maximum(found.to_explain(), 0.0) / samples,
        settings.smallest_gain,
    )
