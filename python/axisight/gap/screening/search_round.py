"""One round of the search: screen every candidate, fit the promising ones, refine the leaders."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.fitting.divergence import Diverged
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.sensitivity import Sensitivity
from axisight.gap.fit.settling import has_settled, settled
from axisight.gap.fit.time_limit import TimeUp
from axisight.gap.fit.tolerance_edges import BENT, bent
from axisight.gap.ranking.clear_lead import CLOSE, clear
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, falls, trial
from axisight.gap.ranking.judgement import stand
from axisight.gap.ranking.posterior import AxisPosterior, as_good_with_less, of_one_formula
from axisight.gap.screening.column_cache import ColumnCache
from axisight.gap.screening.free_bodies import AS_MUCH
from axisight.gap.screening.partial_fit import TrialFit
from axisight.gap.screening.promise import HOPELESS, best_by_axis, least_of_the_arm, promising
from axisight.gap.screening.restart_look_alike import (
    begun_where_it_ended,
    ended_at_bound,
    more_usual,
)
from axisight.gap.screening.restarts import Restarts
from axisight.gap.screening.screening import Screening, ScreeningModel, Start, thinned

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
A = TypeVar("A")
B = TypeVar("B")

# A hypothesis is skipped if its gain from cached sensitivities is below 0.3 of the screening threshold.
_ROUGHLY = 0.3
# Share of the best gain from which an effect of the whole arm does not wait for the next round; for others `AS_MUCH`,
# since one step of a payload finds its mass, not its place.
_HALF_AS_MUCH = 0.5
# Leaders of an axis that are refined.
_REFINED = 2
# Leaders refined at the same time, whatever the number of threads: their results decide which come next.
_AT_ONCE = 2
# Where the leader bends the own parameters: leaders of an axis that are refined, and the share of the leader's score
# that a rival needs.
_REFINED_BENT = 4
_FAR = 0.3
# Steps on all data for a fit that converged on part of the data and only needs to be compared.
_LOOKS = 2
# Coupling of two effects: share of a gain on an axis, or of the error there, above which another effect counts as
# coupled. Candidates on an axis wait for the next round if an effect of another axis already explains more than this
# share.
_FELT = 0.2


def fresh(options: Sequence[Hypothesis], model: FittedModel, refused: set[str]) -> list[Hypothesis]:
    """Return the candidates that the model neither has nor contains, and that were not refused.

    None contains a cause that is sure by itself, which it would replace, unless it is a richer law of the same.
    """
    present = {e.label for e in model.effects}
    sure = {(f.effect.name, f.effect.axis) for f in model.free if f.sure}
    contained = {(name, e.axis) for e in model.effects for name in effect_info(e.name).contains}
    return [
        o
        for o in options
        if o.effect.label not in present | refused
        and (o.effect.name, o.effect.axis) not in contained
        and sure.isdisjoint((x, o.effect.axis) for x in _besides_plainer(o.effect.name))
    ]


def _besides_plainer(name: str) -> list[str]:
    """Return the effects that one contains, without the plainer law that it adds to."""
    info = effect_info(name)
    return [x for x in info.contains if info.plainer is None or x != info.plainer.law]


def _share_without_waiting(start: Start) -> float:
    """Return the share of the best gain above which a candidate does not wait for the next round."""
    # The candidate may be the true cause, and the effect found before only imitate it on another axis.
    return _HALF_AS_MUCH if start.option.effect.axis is None else AS_MUCH


def _share_removed(found: FittedModel, model: FittedModel, axis: int) -> float:
    """Return the share of a model's loss on an axis (from 0) that a fit with further effects removes."""
    before, after = (float(e.loss[e.axis == axis].sum()) for e in (model, found))
    return 1.0 - after / max(before, 1e-300)


class SearchRound:
    """Candidates that are added to one model.

    - ``least`` (n_axes,): smallest fall of the loss for a cause.
    - ``mends``: whether a trial only corrects the formula of a cause in the model.
    - ``offered``: returns candidates for the residual of a model.
    - ``kept``: cache of the candidates' sensitivities, from earlier models and for later ones.
    - ``sensitivities``: by label, of the candidates that were screened.
    - ``skipped``: candidates that failed, with the reason.
    - ``waiting``: candidates that wait for the next round.
    """

    def __init__(
        self,
        fitter: ModelFitter,
        model: FittedModel,
        floor: Array,
        layout: Layout,
        least: Array,
        settings: Settings,
        progress: Progress,
        kept: ColumnCache,
        mends: Callable[[FittedHypothesis], bool],
        offered: Callable[[FittedModel], Sequence[Hypothesis]],
    ) -> None:
        self.fitter, self.model, self.floor, self.kept = fitter, model, floor, kept
        self.layout, self.least, self.mends, self.offered = layout, least, mends, offered
        self.settings, self.progress = settings, progress
        self.current = held_out_loss(model)
        self.bench = ScreeningModel(fitter, model)
        self.screen = Screening(self.bench)
        self.waiting: list[Start] = []
        # Labels of the look-alikes that started from a leader's fit, and of the refined candidates.
        self.usual: set[str] = set()
        self.done: set[str] = set()
        self.sensitivities: dict[str, Sensitivity] = {}
        # The last trials that were judged, and their posteriors.
        self._stood: tuple[list[FittedHypothesis], list[AxisPosterior]] = [], []

    @property
    def rough(self) -> ModelFitter | None:
        """The fitter for the part of the data that candidates are screened on; None if that is all data."""
        part = self.screen.bench
        return None if part is self.bench else part.fitter

    @property
    def screened(self) -> FittedModel:
        """The model on the part of the data that candidates are screened on."""
        return self.screen.model

    @property
    def skipped(self) -> dict[str, str]:
        """Candidates that failed, with the reason."""
        return self.bench.skipped

    def run(self, options: Sequence[Hypothesis], number: int) -> list[FittedHypothesis]:
        """Screen all candidates by one linear step, then fit the promising ones in full."""
        chosen = promising(self._screened(options, number), self._worth())
        tryout = TrialFit(self.bench, self.screen)
        if any(tryout.bends(start) for start in chosen):
            self.bench.begin_nominal()
        self.fitter.work.stage = "fitting"
        with self._threads() as pool:
            found = self._fitted_by_place(pool, chosen, f"fitting candidates, round {number}")
            return self._with_look_alikes(pool, found, options)

    def _screened(self, options: Sequence[Hypothesis], number: int) -> list[Start]:
        self.fitter.work.stage = "screening"
        screen = thinned(self.bench, self.current - self.floor, self.layout, self.kept)
        self.screen = screen
        if any(option.starts and len(option.free) == 1 for option in options):
            screen.bench.begin_nominal()
        rough = self._hopeless_by_cache(screen, options)
        label = f"screening candidates, round {number}"
        todo = screen.groups([o for o in options if o.effect.label not in rough])
        with self._threads() as pool:
            screened = self._each(pool, screen.starts, todo, label)
        self.skipped.update(screen.bench.skipped)
        starts = [*rough.values(), *(start for group in screened for start in group)]
        known = (s.sensitivity for s in starts)
        self.sensitivities = {s.option.effect.label: s for s in known if s is not None}
        return starts

    def _hopeless_by_cache(
        self, screen: Screening, options: Sequence[Hypothesis]
    ) -> dict[str, Start]:
        """Return the candidates, by label, whose gain from cached sensitivities is too small to screen them again."""
        if not self.kept.logs:
            return {}
        kept = screen.from_kept()
        known = [o for o in options if kept.knows(o)]
        worth = _ROUGHLY * HOPELESS * self._worth()
        starts = (start for o in known for start in kept.starts([o]))
        return {
            s.option.effect.label: s
            for s in starts
            if (s.falls is None and s.gain < worth[(s.option.effect.axis or 1) - 1])
            or (s.falls is not None and np.all(s.falls < worth))
        }

    def _with_look_alikes(
        self,
        pool: ThreadPoolExecutor,
        trials: list[FittedHypothesis],
        options: Sequence[Hypothesis],
    ) -> list[FittedHypothesis]:
        """Add common look-alikes of the leaders, whose own start values may have been too far off."""
        tried = {t.label for t in trials}
        begun = [
            start
            for standing in self.standings(trials)
            if standing.best.trial.hypothesis.effect.axis == standing.axis + 1
            for start in begun_where_it_ended(standing.best.trial, options, tried)
        ]
        self.usual |= {start.option.effect.label for start in begun}
        return [*trials, *self._fitted(pool, begun)]

    def _with_restarts(
        self,
        pool: ThreadPoolExecutor,
        trials: list[FittedHypothesis],
        options: Sequence[Hypothesis],
    ) -> list[FittedHypothesis]:
        """Add or replace hypotheses by restarts from the leaders' fits; see `Restarts`."""
        return Restarts(self, pool).added(trials, options)

    def looked_at(self, begun: FittedModel) -> FittedModel | Diverged:
        """Return a fit to part of the data, evaluated on all of it."""
        found = self.fitter.fit(begun.free, begun, max_iterations=_LOOKS)
        if isinstance(found, Diverged):
            return found
        # An unsettled fit does not count as renewed: if it becomes a cause, it is fitted on.
        return replace(found, renewed=found.renewed and has_settled(found))

    def compared(self, begun: FittedModel) -> FittedModel | Diverged | None:
        """Return a fit to part of the data, evaluated on all of it; None if that diverges.

        If it hardly bends the own parameters, their sensitivities are those of the model.
        """
        if bent(self.fitter, begun) >= BENT:
            return self.looked_at(begun)
        *others, option = begun.free
        solve = partial(self.fitter.fit, lazy=True, max_iterations=0)
        return self.bench.attempt(solve, option, begun.robot_values, beside=others, close=True)

    def run_waiting(
        self, trials: list[FittedHypothesis], options: Sequence[Hypothesis], number: int
    ) -> list[FittedHypothesis]:
        """Fit the candidates that were left to the next round; return all trials."""
        chosen, self.waiting = self.waiting, []
        if not chosen:
            return trials
        self.fitter.work.stage = "fitting"
        with self._threads() as pool:
            found = self._with_look_alikes(pool, [*trials, *self._fitted(pool, chosen)], options)
        self.progress(f"fitting further candidates, round {number}", len(chosen), len(chosen))
        return found

    @contextmanager
    def _threads(self) -> Iterator[ThreadPoolExecutor]:
        """Yield a pool of threads; its work is cancelled if the caller is interrupted."""
        with ThreadPoolExecutor(self.settings.threads) as pool:
            try:
                yield pool
            except TimeUp:
                # What has begun ends; nothing else begins.
                pool.shutdown(wait=True, cancel_futures=True)
                raise
            except BaseException:
                self.fitter.cancel.cancel()
                pool.shutdown(wait=True, cancel_futures=True)
                raise

    def _fitted_by_place(
        self, pool: ThreadPoolExecutor, chosen: Sequence[Start], label: str
    ) -> list[FittedHypothesis]:
        """Fit the chosen candidates axis by axis, the most promising axis first.

        An earlier fit may already explain more than 20 % of the error on an axis. The other candidates of that axis are
        coupled with it and go to ``waiting``, for the next round. Candidates with nearly the best gain on the axis of
        that fit do not wait.
        """
        left = np.maximum(self.layout.by_axis(self.current - self.floor), 1e-12)
        most = best_by_axis(chosen, self.layout.n_axes)
        found: list[FittedHypothesis] = []
        done = 0
        for axis, here in self._turns(chosen):
            now = here
            if axis is not None and found:
                explained = falls(found, self.current, self.layout)[:, axis - 1] / left[axis - 1]
                felt = found[int(np.argmax(explained))].hypothesis.effect.axis
                if explained.max() > _FELT:
                    bar = most.max() if felt is None else most[felt - 1]
                    now = [s for s in here if s.gain > _share_without_waiting(s) * bar]
                    self.waiting += [s for s in here if s.gain <= _share_without_waiting(s) * bar]
            self.progress(label, done, len(chosen))
            found += self._fitted(pool, now)
            done += len(here)
        self.progress(label, done, len(chosen))
        return found

    def _turns(self, chosen: Sequence[Start]) -> list[tuple[int | None, list[Start]]]:
        """Return the axes, the most promising first, each with the candidates that are fitted there.

        An effect of the whole arm is fitted with the first axis where it comes near the best candidate.
        """
        best = best_by_axis(chosen, self.layout.n_axes)
        axes = {a for s in chosen if (a := s.option.effect.axis) is not None}
        places: list[int | None] = [*sorted(axes, key=lambda a: -best[a - 1])]
        turns: dict[int | None, list[Start]] = {place: [] for place in places or [None]}
        least = least_of_the_arm(self._worth(), best)
        for start in chosen:
            place = start.option.effect.axis
            if place is None and start.falls is not None:
                near = start.falls > least
                place = next((a for a in places if a is not None and near[a - 1]), None)
            turns[next(iter(turns)) if place is None else place].append(start)
        return list(turns.items())

    def _fitted(self, pool: ThreadPoolExecutor, starts: Sequence[Start]) -> list[FittedHypothesis]:
        """Return candidates fitted on the data of the screen and evaluated on all data; without those that diverge."""
        tryout = TrialFit(self.bench, self.screen)
        begun = pool.map(tryout.begun, starts)
        return [t for t in pool.map(tryout.ended, begun) if t is not None]

    def standings(self, trials: Sequence[FittedHypothesis]) -> list[AxisPosterior]:
        """Return the posteriors of the trials, for each axis that one of them improves."""
        # They are asked for again and again, mostly for the same trials.
        if not same(self._stood[0], trials):
            self._stood = list(trials), self._standings(trials)
        return list(self._stood[1])

    def _standings(self, trials: Sequence[FittedHypothesis]) -> list[AxisPosterior]:
        found = [
            stand(
                trials,
                self.current,
                self.floor,
                self.layout,
                axis,
                without=self.model,
                explained_share=self.settings.explained_share,
            )
            for axis in range(self.layout.n_axes)
        ]
        return [s.usual_first().play_first() for s in found if s is not None]

    def refined(
        self,
        trials: list[FittedHypothesis],
        options: Sequence[Hypothesis],
        number: int,
        *,
        even_felt: bool = False,
    ) -> list[FittedHypothesis]:
        """Fit the leaders of each axis again with sensitivities of their own; return the trials with the new fits.

        A large effect distorts the re-fitted simulator, and with it the sensitivities that were taken there. So the
        leaders are fitted again before one becomes a cause. ``even_felt``: refine leaders on axes that are coupled with
        the strongest effect, too.
        """
        label = f"refining the leaders, round {number}"
        self.fitter.work.stage = "refining"
        with self._threads() as pool:
            while todo := self._refined_next(trials, even_felt=even_felt):
                self.progress(label, len(self.done), len(self.done) + len(todo))
                self.done.update(t.label for t in todo)
                leaders = [self._leader_before(t, trials) for t in todo]
                found = pool.map(self._refined, todo, leaders)
                better = dict(zip(map(id, todo), found, strict=True))
                with_them = (better.get(id(t), t) for t in trials)
                trials = [t for t in with_them if t is not None]
            trials = self._with_restarts(pool, trials, options)
        self.progress(label, 1, 1)
        return trials

    def _refined_next(
        self, trials: Sequence[FittedHypothesis], *, even_felt: bool
    ) -> list[FittedHypothesis]:
        """Return the leaders to refine next: two where a leader bends the own parameters, else one.

        A leader with sensitivities of its own may bend them no more, so this is checked anew each time.
        """
        crooked = self._bent_axes(trials)
        todo = self._worth_refining(trials, crooked, even_felt=even_felt)
        return todo[: _AT_ONCE if crooked else 1]

    def _leader_before(
        self, one: FittedHypothesis, trials: Sequence[FittedHypothesis]
    ) -> FittedHypothesis | None:
        """Return the leader on the axis of a trial; None if the trial leads any axis, or if its axis has no leader."""
        leaders = {s.axis: s.best.trial for s in self.standings(trials)}
        if any(leader is one for leader in leaders.values()):
            return None
        return leaders.get((one.hypothesis.effect.axis or 0) - 1)

    def _refined(
        self, one: FittedHypothesis, leader: FittedHypothesis | None
    ) -> FittedHypothesis | None:
        """Return a trial fitted with sensitivities of its own; None if it diverges.

        The unchanged trial is returned if the new fit stays far behind that of ``leader``.
        """
        fitted = self._comparable(one.fitted, None if leader is None else leader.fitted)
        if isinstance(fitted, Diverged):
            self.skipped[one.label] = str(fitted)
            return None
        return one if fitted is None else trial(one.hypothesis, fitted, self.model)

    def _comparable(
        self, start: FittedModel, leader: FittedModel | None
    ) -> FittedModel | Diverged | None:
        """Return a fit that can be compared: converged on part of the data, then evaluated on all of it.

        None if it stays far behind ``leader`` on that part.
        """
        if self.rough is None or start.renewed:
            return settled(self.fitter, start.free, start)
        begun = settled(self.rough, start.free, start)
        if isinstance(begun, Diverged):
            return begun
        axis = start.free[-1].effect.axis
        if leader is not None and axis is not None:
            needed = CLOSE * _share_removed(leader, self.model, axis - 1)
            if _share_removed(begun, self.screen.model, axis - 1) < needed:
                return None
        return self.looked_at(begun)

    def _bent_axes(self, trials: Sequence[FittedHypothesis]) -> set[int]:
        """Return the axes (from 0) whose leader bends the own parameters.

        The fits of its rivals there used distorted sensitivities.
        """
        leaders = ((s.axis, s.best.trial.fitted) for s in self.standings(trials))
        return {axis for axis, fitted in leaders if bent(self.fitter, fitted) >= BENT}

    def _worth_refining(
        self, trials: Sequence[FittedHypothesis], crooked: set[int], *, even_felt: bool
    ) -> list[FittedHypothesis]:
        """Return the leaders, and close rivals, that are not refined yet, on axes where the best one is not clear.

        An effect is refined on its own axis, or on an axis that it leads. Its score on other axes says little:
        sensitivities of its own change it there. Axes are left out where candidates wait, or where the leader gains too
        little for a cause.
        """
        out = []
        standings = self.standings(trials)
        leaders = {s.best.trial.label for s in standings}
        led: dict[int | None, str] = {s.axis + 1: s.best.trial.label for s in standings}
        homes = {s.best.trial.label: s.best.trial.hypothesis.effect.axis for s in standings}
        # Axes of an effect that leads another axis, while something else leads its own.
        away = {home for label, home in homes.items() if led.get(home, label) != label}
        # On axes with waiting candidates, the leader has not met its rivals yet.
        wait = {start.option.effect.axis for start in self.waiting}
        for standing in standings if even_felt else self._not_coupled(standings, trials):
            if standing.axis + 1 in wait:
                continue
            leader = standing.best
            gain = leader.gain * self.layout.samples()[standing.axis]
            if gain < self.least[standing.axis] or self.mends(leader.trial):
                continue
            bends = standing.axis in crooked
            count, close = (_REFINED_BENT, _FAR) if bends else (_REFINED, CLOSE)
            # A law with a parameter at its bound may equal a common look-alike. Only the look-alike's own fit can rule
            # that out.
            special = more_usual(leader.trial) if ended_at_bound(leader.trial) else set()
            usual = self.usual | more_usual(leader.trial)
            rivals = standing.ranked[:count]
            if clear(standing) and not bends:
                # An effect of this axis leads elsewhere with a refined fit. Refine the leader here before the two are
                # compared.
                rivals = rivals[:1] if standing.axis + 1 in away else ()
            usual |= {r.trial.label for r in as_good_with_less(standing)}
            usual |= {r.trial.label for r in of_one_formula(standing)}
            rivals += tuple(
                r for r in standing.ranked if r.trial.label in usual and r not in rivals
            )
            for r in rivals:
                place, label = r.trial.hypothesis.effect.axis, r.trial.label
                here = place in (None, standing.axis + 1) or label in leaders
                share = _FAR if label in usual else close
                near = r.score > max(0.5 * self.settings.smallest_score, share * leader.score)
                near &= leader.trial.label not in self.done or standing.in_reach(r)
                # A law at its bound may be the common look-alike, however poor the fit of that was.
                near = near or label in special
                if here and near and label not in self.done and r.trial not in out:
                    out.append(r.trial)
        return out

    def _not_coupled(
        self, standings: Sequence[AxisPosterior], trials: Sequence[FittedHypothesis]
    ) -> Sequence[AxisPosterior]:
        """Return the posteriors without those whose leader is coupled with the effect that gains most in total.

        These wait for the next round, when that effect is in the model. The effect's own axis stays: it must lead
        there. Without any candidate there is nothing to be coupled with.
        """
        if not standings:
            return standings
        fall = falls(trials, self.current, self.layout)
        place = {t.label: i for i, t in enumerate(trials)}
        leaders = [place[s.best.trial.label] for s in standings]
        first = place.get(self.first(standings, trials), 0)
        home = trials[first].hypothesis.effect.axis
        return [
            s
            for i, s in zip(leaders, standings, strict=True)
            if i == first or s.axis + 1 == home or not interact(first, i, s.axis, fall)
        ]

    def first(self, standings: Sequence[AxisPosterior], trials: Sequence[FittedHypothesis]) -> str:
        """Return the label of the leader that gains most over all axes; empty if no axis has a leader."""
        fall = falls(trials, self.current, self.layout).sum(axis=1)
        gain = {t.label: float(f) for t, f in zip(trials, fall, strict=True)}
        return max((s.best.trial.label for s in standings), key=gain.__getitem__, default="")

    def _worth(self) -> Array:
        """Return the smallest fall of the loss of each axis (n_axes,) for a cause there."""
        left = np.maximum(self.layout.by_axis(self.current - self.floor), 0.0)
        return np.asarray(np.maximum(self.least, self.settings.smallest_score * left))

    def _each(
        self, pool: ThreadPoolExecutor, work: Callable[[A], B], items: Sequence[A], label: str
    ) -> list[B]:
        out = []
        for k, value in enumerate(pool.map(work, items)):
            out.append(value)
            self.progress(label, k + 1, len(items))
        return out


def same(these: Sequence[object], others: Sequence[object]) -> bool:
    """Whether two sequences hold the same objects in the same order."""
    return len(these) == len(others) and all(map(operator.is_, these, others))


def interact(one: int, other: int, axis: int, fall: Array) -> bool:
    """Whether adding trial ``one`` to the model would change the gain of trial ``other`` on ``axis`` (from 0).

    ``fall`` (n_trials, n_axes): fall of the loss by each trial.
    """
    return bool(abs(fall[one, axis]) > _FELT * abs(fall[other, axis]))
