"""Pairs of effects on one axis that hide each other when they are tried one at a time.

If viscous friction and an offset are both missing, each alone leaves the error of the other. Its gain then varies
over time, so neither is significant alone. Together both are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.drive_lags import is_lag
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.judgement import stand
from axisight.gap.screening.restart_look_alike import ended_at_bound
from axisight.gap.search.composites import SHOWS_BESIDE, Found, all_fitted, fitted_with, parts_of
from axisight.statistics.tails import normal_deviate

Array = NDArray[np.float64]

# Number of candidates of an axis that are tried in pairs.
_PARTNERS = 4
# Score that each of a pair needs alone, as a share of the score that a cause needs.
_HINT = 0.2


@dataclass(frozen=True)
class Pair:
    """Two effects that are causes of ``axis`` (from 0) together: ``both`` in one fit.

    ``gain``: fall of the held-out loss there; ``members``: each with its posterior beside the other;
    ``without``: the model without each, which has the other alone.
    """

    axis: int
    both: FittedHypothesis
    gain: float
    members: tuple[Found, Found]
    without: tuple[FittedModel, FittedModel]


class Pairs:
    """Pairs of candidates on top of one model, for axes where no single candidate is a cause."""

    def __init__(
        self,
        fitter: ModelFitter,
        model: FittedModel,
        trials: Sequence[FittedHypothesis],
        current: Array,
        floor: Array,
        layout: Layout,
        settings: Settings,
    ) -> None:
        self.fitter, self.model, self.trials, self.current = fitter, model, trials, current
        self.floor, self.layout, self.settings = floor, layout, settings
        # Fits of pairs by the labels of their members, in order.
        self._fits: dict[tuple[str, str], FittedHypothesis | None] = {}

    def found(self, axis: int, first: float, tried: int) -> Pair | None:
        """Return the pair that explains most of ``axis`` (from 0); None if it is not significant.

        ``first``: loss above the floor there before any effect; ``tried``: number of candidates of the search.
        """
        here = self.layout.axis == axis
        left = float((self.current - self.floor)[here].sum())
        samples = float(self.layout.samples()[axis])
        if left <= self.settings.smallest_gain * samples:
            return None
        mine = [t for t in self.trials if self._hints(t, axis, left)]
        mine = self._taken_apart(sorted(mine, key=lambda t: float(t.held_out[here].sum())))
        pairs = [p for p in combinations(mine, 2) if not _nested(*p)]
        fits = {(a.label, b.label): f for a, b in pairs if (f := self._both(a, b)) is not None}
        if not fits:
            return None
        best = min(fits, key=lambda k: float(fits[k].held_out[here].sum()) + fits[k].cost)
        both = fits[best]
        gain = float((self.current - both.held_out)[here].sum())
        worth = gain > max(
            self.settings.smallest_score * left,
            self.settings.smallest_share * first,
            self.settings.smallest_gain * samples,
        )
        # Bonferroni over all pairs that could have been tried.
        level = self.settings.false_alarms / max(tried * len(mine), 1)
        needed = max(self.settings.significance, normal_deviate(level))
        if not worth or self.layout.significance(self.current, both.held_out, axis) <= needed:
            return None
        one = self._beside(best[0], best[1], mine, axis)
        other = self._beside(best[1], best[0], mine, axis)
        if one is None or other is None:
            return None
        alone = {t.label: t.fitted for t in mine}
        return Pair(axis, both, gain, (one, other), (alone[best[1]], alone[best[0]]))

    def _hints(self, t: FittedHypothesis, axis: int, left: float) -> bool:
        """Whether a candidate of ``axis`` explains some of the loss ``left`` there and is no sample and hold."""
        effect = t.fitted.effects[-1]
        if is_lag(effect) and self.fitter.within_tolerance(effect):
            return False
        fall = float((self.current - t.held_out)[self.layout.axis == axis].sum())
        own = t.hypothesis.effect.axis == axis + 1
        return own and fall > _HINT * self.settings.smallest_score * left

    def _taken_apart(self, mine: Sequence[FittedHypothesis]) -> list[FittedHypothesis]:
        """Return the candidates that are tried in pairs, the best first.

        A composite with a parameter at its bound is replaced by its parts. Example: an offset larger than the dry
        friction cannot be asymmetric friction.
        """
        partners = list(mine[:_PARTNERS])
        present = {e.label for e in self.model.effects}
        for composite in [t for t in partners if ended_at_bound(t)]:
            parts = self._parts(composite, present | {t.label for t in partners})
            if parts:
                partners = [t for t in partners if t is not composite] + parts
        return partners

    def _parts(self, composite: FittedHypothesis, known: set[str]) -> list[FittedHypothesis]:
        """Return the parts of a composite, each fitted on top of the model; without those already ``known``."""
        free = parts_of(composite.fitted.effects[-1], composite.hypothesis, known)
        return (
            all_fitted(fitted_with(self.fitter, [*self.model.free, f], self.model) for f in free)
            or []
        )

    def _both(self, one: FittedHypothesis, other: FittedHypothesis) -> FittedHypothesis | None:
        """Return ``other`` fitted on top of the model with ``one``; None if it diverges."""
        key = one.label, other.label
        if key not in self._fits:
            free = [*one.fitted.free, other.hypothesis]
            self._fits[key] = fitted_with(self.fitter, free, one.fitted, lazy=True)
        return self._fits[key]

    def _beside(
        self, one: str, partner: str, mine: Sequence[FittedHypothesis], axis: int
    ) -> Found | None:
        """Return ``one`` with its posterior beside its partner; None if it does not lead there significantly."""
        base = next(t for t in mine if t.label == partner)
        others = [t for t in mine if t is not base and not _nested(t, base)]
        beside = [x for t in others if (x := self._both(base, t)) is not None]
        standing = stand(
            beside,
            base.held_out,
            self.floor,
            self.layout,
            axis,
            without=base.fitted,
            explained_share=self.settings.explained_share,
        )
        if standing is None or standing.best.trial.label != one:
            return None
        sure = self.layout.significance(base.held_out, standing.best.trial.held_out, axis)
        return (standing.best, standing) if sure > SHOWS_BESIDE else None


def _nested(one: FittedHypothesis, other: FittedHypothesis) -> bool:
    """Whether one of two effects contains the other."""
    a, b = one.hypothesis.effect.name, other.hypothesis.effect.name
    return a in effect_info(b).contains or b in effect_info(a).contains
