"""Fits hypotheses again that replace the leader of an axis, starting from the leader's fit.

Some minima are too narrow for start values from data. Three kinds of restarts exist: gear laws on the curve of another
law, stiction after pre-sliding, and laws of friction after a plainer one. If one hypothesis has several starts, one
linear step selects those that get a fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Protocol

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import linear_gain
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import RENEWALS, has_settled, settled
from axisight.gap.fit.tolerance_edges import BENT, bent
from axisight.gap.ranking.drive_lags import ended, lags_beside
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, trial
from axisight.gap.ranking.posterior import AxisPosterior
from axisight.gap.screening.restart_gear_law import begun_on_curves
from axisight.gap.screening.restart_stiction import begun_sticking
from axisight.gap.screening.restart_wider_law import begun_wider

Restart = tuple[FittedModel, Hypothesis, Mapping[str, float]]
"""The model whose last effect is replaced, the hypothesis that replaces it, and start values of the own parameters."""


class Field(Protocol):
    """The part of `SearchRound` that restarts need."""

    fitter: ModelFitter
    model: FittedModel
    offered: Callable[[FittedModel], Sequence[Hypothesis]]

    @property
    def rough(self) -> ModelFitter | None:
        """The fitter for part of the data; None if candidates are screened on all data."""

    @property
    def screened(self) -> FittedModel:
        """The model on that part of the data."""

    @property
    def skipped(self) -> dict[str, str]:
        """Candidates that failed, with the reason."""

    def standings(self, trials: Sequence[FittedHypothesis]) -> list[AxisPosterior]:
        """Return the posteriors of the axes that the trials improve."""

    def compared(self, begun: FittedModel) -> FittedModel | Diverged | None:
        """Return a fit to part of the data, evaluated on all of it; None if that diverges."""


# Starts of one hypothesis that get a fit: the best two by one linear step. The second may lie in another minimum.
_STARTS_FITTED = 2


class Restarts:
    """Restarts of one round: hypotheses that start where the fit of a leader ended."""

    def __init__(self, of: Field, pool: ThreadPoolExecutor) -> None:
        self.round, self.pool = of, pool

    def added(
        self, trials: list[FittedHypothesis], options: Sequence[Hypothesis]
    ) -> list[FittedHypothesis]:
        """Return the trials with restarts added, or put in place of the same hypothesis if they fit better."""
        here = self.round
        trials = self._with_gears(trials, options)
        wider = begun_wider(here.standings(trials), trials, here.offered)
        trials = self._with_better(trials, [(e, o, e.robot_values) for e, o in wider])
        sticking = begun_sticking(here.standings(trials), options)
        trials = self._with_better(trials, [(e, o, e.robot_values) for e, o in sticking])
        return self._with_lags(trials, options)

    def _with_gears(
        self, trials: list[FittedHypothesis], options: Sequence[Hypothesis]
    ) -> list[FittedHypothesis]:
        """Add restarts of gear laws until no new law leads.

        A law that becomes the leader has a curve of its own, from which the others start again.
        """
        led: set[str] = set()
        here = self.round
        while begun := begun_on_curves(here.standings(trials), led, options, here.fitter.robot):
            trials = self._with_better(trials, begun)
        return trials

    def _with_better(
        self, trials: Sequence[FittedHypothesis], begun: Sequence[Restart]
    ) -> list[FittedHypothesis]:
        """Fit restarts; add those that are new, and replace those that fit better than before.

        Of several starts of one hypothesis, only the one that ends best is evaluated on all data.
        """
        known = {t.label: t for t in trials}
        chosen = self._promising(begun)
        ended = self.pool.map(lambda one: self._begun(*one), chosen)
        best: dict[str, tuple[Hypothesis, FittedModel]] = {}
        for (_, option, _), fit in zip(chosen, ended, strict=True):
            label = option.effect.label
            if fit is not None and (label not in best or fit.total < best[label][1].total):
                best[label] = option, fit
        for found in self.pool.map(lambda one: self._ended(*one), best.values()):
            if found is not None:
                before = known.get(found.label)
                if before is None or found.fitted.total < before.fitted.total:
                    known[found.label] = found
        return list(known.values())

    def _promising(self, begun: Sequence[Restart]) -> list[Restart]:
        """Return the restarts to fit: of each hypothesis the best ``_STARTS_FITTED`` by one linear step."""
        by_label: dict[str, list[Restart]] = {}
        for one in begun:
            by_label.setdefault(one[1].effect.label, []).append(one)
        crowded = [one for same in by_label.values() if len(same) > _STARTS_FITTED for one in same]
        promised = dict(zip(map(id, crowded), self.pool.map(self._promised, crowded), strict=True))
        return [
            one
            for same in by_label.values()
            for one in sorted(same, key=lambda x: promised.get(id(x), 0.0))[:_STARTS_FITTED]
        ]

    def _promised(self, one: Restart) -> float:
        """Return the loss that one linear step from a restart predicts; infinite if it diverges."""
        leader, option, values = one
        part = self.round.rough or self.round.fitter
        if part is not self.round.fitter:
            # The leader's columns belong to all data. The columns of the screened model are near enough to order
            # starts.
            leader = replace(leader, columns=self.round.screened.columns)
        at = part.evaluate([*leader.free[:-1], option], leader, robot_values=values)
        return float("inf") if isinstance(at, Diverged) else at.total - linear_gain(at)

    def _with_lags(
        self, trials: list[FittedHypothesis], options: Sequence[Hypothesis]
    ) -> list[FittedHypothesis]:
        """Replace delays and lags by their fully converged fits, on axes that one of them leads."""
        known = {t.label: t for t in trials}
        for standing in self.round.standings(trials):
            if lags := lags_beside(standing):
                fits = ended(self.round.fitter, lags, options)
                found = (trial(fit.free[-1], fit, self.round.model) for fit in fits)
                known |= {t.label: t for t in found}
        return list(known.values())

    def _begun(
        self, leader: FittedModel, option: Hypothesis, values: Mapping[str, float]
    ) -> FittedModel | None:
        """Return a fit in the place of a leader, from its values, to the data of the screen; None if it diverges."""
        here = self.round
        part = here.rough or here.fitter
        free = [*leader.free[:-1], option]
        if bent(here.fitter, leader) < BENT:
            # Sensitivities of the own parameters are those of the screened model.
            start = replace(leader, columns=here.screened.columns)
            found = part.fit(free, start, robot_values=values, lazy=True)
        else:
            found = part.fit(free, leader, robot_values=values, refreshes=RENEWALS)
        if not isinstance(found, Diverged) and not has_settled(found):
            found = settled(part, found.free, found)
        return self._held(found, option.effect.label)

    def _ended(self, option: Hypothesis, begun: FittedModel) -> FittedHypothesis | None:
        """Return a fit to the data of the screen as a trial on all data; None if it diverges there."""
        here = self.round
        all_data = here.rough is None
        found = begun if all_data else self._held(here.compared(begun), option.effect.label)
        return None if found is None else trial(option, found, here.model)

    def _held(self, found: FittedModel | Diverged | None, label: str) -> FittedModel | None:
        if isinstance(found, Diverged):
            self.round.skipped.setdefault(label, str(found))
            return None
        return found
