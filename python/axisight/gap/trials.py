"""One round of a search: screen every candidate, fit the promising ones, refine the leaders."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from axisight._core import Courses
from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.gap.decide import Standing, Trial, stand, trial
from axisight.gap.layout import Layout
from axisight.gap.model import Evidence, FreeEffect, Linearized, ModelFitter
from axisight.gap.score import held_out_loss, linear_gain
from axisight.gap.settings import Settings

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
A = TypeVar("A")
B = TypeVar("B")

# Parameters of candidates that are screened together: the core takes so many derivatives at once.
_TOGETHER = 4
# Candidates of a place fitted in full: the best of the screen, and all that come near them.
_FITTED = 4
_NEAR = 0.3
# A linear step promises less than a fit may gain; this much less of what is worth naming.
_HOPELESS = 0.3
# Candidates fitted where none is worth it.
_LOOKED_AT = 3
# Leaders of an axis that are refined, unless the first already explains nearly everything.
_REFINED = 2
_GOOD_ENOUGH = 0.95
# Steps of the fit of a candidate; leaders go on from there.
_STEPS = 8
# Evaluations between two starts of an effect.
_SCANS = 10
# Share of a gain that another candidate may have on the same axis and not count as felt.
_FELT = 0.2


def kept_beside(free: Sequence[FreeEffect], new: FreeEffect) -> list[FreeEffect]:
    """Return the effects of a model without those that a new one contains at the same place."""
    contains = effect_info(new.effect.name).contains
    return [f for f in free if f.effect.name not in contains or f.effect.axis != new.effect.axis]


def fresh(options: Sequence[FreeEffect], model: Evidence, refused: set[str]) -> list[FreeEffect]:
    """Return the candidates that the model neither has nor contains, and that were not refused."""
    present = {e.label for e in model.effects}
    contained = {(name, e.axis) for e in model.effects for name in effect_info(e.name).contains}
    return [
        o
        for o in options
        if o.effect.label not in present | refused
        and (o.effect.name, o.effect.axis) not in contained
    ]


def settled(
    fitter: ModelFitter, free: Sequence[FreeEffect], start: Evidence, *, max_iterations: int = 6
) -> Evidence:
    """Return a fit with sensitivities of its own, as often renewed as it needs."""
    if not start.renewed or len(free) != len(start.free):
        start = fitter.fit(free, start, refreshes=1)
    # One that stalled with sensitivities renewed at every step gets no further.
    if start.converged or (start.fresh and start.status == "stalled"):
        return start
    return fitter.fit(start.free, start, fresh=True, max_iterations=max_iterations)


@dataclass(frozen=True)
class _Start:
    """Where the fit of a candidate begins, and the gain it promises."""

    option: FreeEffect
    robot_values: Mapping[str, float]
    gain: float


class Trials:
    """Candidates on top of one model. Failures are kept in ``skipped`` with their reason."""

    def __init__(
        self,
        fitter: ModelFitter,
        model: Evidence,
        floor: Array,
        layout: Layout,
        settings: Settings,
        progress: Progress,
    ) -> None:
        self.fitter, self.model, self.floor = fitter, model, floor
        self.layout, self.settings, self.progress = layout, settings, progress
        self.current = held_out_loss(model)
        self.near = fitter.runs(model)
        self.near_nominal: Courses | None = None
        self.skipped: dict[str, str] = {}

    def run(self, options: Sequence[FreeEffect], number: int) -> list[Trial]:
        """Screen all candidates by one linear step, fit the promising ones in full."""
        if any(option.starts and len(option.free) == 1 for option in options):
            self.near_nominal = self.fitter.runs(self.model, {})
        with ThreadPoolExecutor(self.settings.threads) as pool:
            try:
                label = f"screening candidates, round {number}"
                groups = self._groups(options)
                screened = self._each(pool, self._screened, groups, label)
                starts = [start for group in screened for start in group]
                chosen = [starts[i] for i in self._promising(starts)]
                label = f"fitting candidates, round {number}"
                fitted = self._each(pool, self._fitted, chosen, label)
            except BaseException:
                self.fitter.cancel.cancel()
                pool.shutdown(wait=True, cancel_futures=True)
                raise
        return [t for t in fitted if t is not None]

    def standings(self, trials: Sequence[Trial]) -> list[Standing]:
        """Return how the trials stand on each axis that one of them improves."""
        found = [
            stand(
                trials,
                self.current,
                self.floor,
                self.layout,
                axis,
                explained_share=self.settings.explained_share,
            )
            for axis in range(self.layout.n_axes)
        ]
        return [s for s in found if s is not None]

    def refined(self, trials: list[Trial], number: int) -> list[Trial]:
        """Fit the leaders of each axis again with the simulator's sensitivities renewed.

        A large effect bends the re-fitted simulator, and the sensitivities taken from
        it; the leaders deserve better before one of them is believed.
        """
        done: set[str] = set()
        label = f"refining the leaders, round {number}"
        while todo := next(iter(self._worth_refining(trials, done)), None):
            self.progress(label, len(done), len(done) + 1)
            done.add(todo.label)
            better = trial(todo.candidate, settled(self.fitter, todo.evidence.free, todo.evidence))
            trials = [better if t is todo else t for t in trials]
        self.progress(label, 1, 1)
        return trials

    def _worth_refining(self, trials: Sequence[Trial], done: set[str]) -> list[Trial]:
        """Return the leaders that explain anything but not nearly everything, not done yet."""
        out = []
        for standing in self.standings(trials):
            leader = standing.best
            if leader.score > _GOOD_ENOUGH or leader.gain < self.settings.smallest_gain:
                continue
            for r in standing.ranked[:_REFINED]:
                near = r.score > 0.02 and r.score > 0.3 * leader.score
                if near and r.trial.label not in done and r.trial not in out:
                    out.append(r.trial)
        return out

    def _attempt(
        self, solve: Callable[..., A], option: FreeEffect, values: Mapping[str, float] | None
    ) -> A | None:
        effects = [*kept_beside(self.model.free, option), option]
        # Runs serve where the simulator's own parameters are those of the runs, or near them.
        near = (
            self.near if values is None or values == self.model.robot_values else self.near_nominal
        )
        try:
            return solve(effects, self.model, robot_values=values, near=near)
        except InputError as error:
            # A candidate that cannot be simulated is out, and the result says so.
            self.skipped[option.effect.label] = str(error)
            return None

    def _groups(self, options: Sequence[FreeEffect]) -> list[list[FreeEffect]]:
        """Return the candidates by evaluation: those that do nothing as they are share one."""
        alone: list[FreeEffect] = []
        together: list[FreeEffect] = []
        for option in options:
            beside = kept_beside(self.model.free, option)
            idle = not option.effect.acts and len(beside) == len(self.model.free)
            (together if idle and len(option.free) <= _TOGETHER else alone).append(option)
        groups: list[list[FreeEffect]] = []
        for option in sorted(together, key=lambda o: -len(o.free)):
            room = (g for g in groups if _size(g) + len(option.free) <= _TOGETHER)
            group = next(room, None)
            if group is None:
                groups.append([option])
            else:
                group.append(option)
        return [[option] for option in alone] + groups

    def _screened(self, group: list[FreeEffect]) -> list[_Start]:
        """Return where fits of the candidates would begin, and what they promise."""
        found: Sequence[Linearized | None] = []
        if len(group) > 1:
            # One that cannot be simulated leaves all to be tried alone.
            with suppress(InputError):
                found = self.fitter.evaluate_each(group, self.model, self.near)
        found = found or [self._attempt(self.fitter.evaluate, o, None) for o in group]
        return [self._best_start(o, e) for o, e in zip(group, found, strict=True)]

    def _best_start(self, option: FreeEffect, evidence: Linearized | None) -> _Start:
        best = _Start(option, self.model.robot_values, -np.inf)
        if evidence is not None:
            best = replace(best, gain=self.model.total - evidence.total + linear_gain(evidence))
        if len(option.free) > 1:
            # Further starts of one that does nothing as it is: by what a step from there promises.
            # Only sizes: where it has none, its shape shows nothing.
            sizes = replace(option, free=tuple(n for n in option.free if n in _amplitudes(option)))
            for begin in (option.at(values) for values in option.starts):
                at = sizes.at(begin.effect.parameters or {})
                other = self._attempt(self.fitter.evaluate, at, None)
                gain = -np.inf if other is None else linear_gain(other)
                if gain > best.gain:
                    best = replace(best, option=begin, gain=gain)
        elif option.starts:
            begin, gain = self._best_of_starts(option)
            if gain > best.gain:
                best = _Start(begin, {}, gain)
        return best

    def _best_of_starts(self, option: FreeEffect) -> tuple[FreeEffect, float]:
        """Return the candidate at the best of its own starts, and what it gains there.

        A large effect bends the re-fitted simulator: these begin with one that is not re-fitted.
        """
        name = option.free[0]

        def loss(value: float) -> float:
            found = self._attempt(self.fitter.loss, option.at({name: value}), {})
            return np.inf if found is None else found

        values = sorted(s[name] for s in option.starts)
        losses = [loss(v) for v in values]
        at = int(np.argmin(losses))
        least, value = losses[at], values[at]
        if least < self.model.total:
            # The valley is narrower than the steps between starts.
            between = (values[max(at - 1, 0)], values[min(at + 1, len(values) - 1)])
            finer = minimize_scalar(
                loss,
                bounds=between,
                method="bounded",
                options={"maxiter": _SCANS, "xatol": 0.003 * value},
            )
            if finer.fun < least:
                least, value = float(finer.fun), float(finer.x)
        return option.at({name: value}), self.model.total - least

    def _fitted(self, start: _Start) -> Trial | None:
        # One that bends the simulator has sensitivities of its own.
        bends = start.robot_values is not self.model.robot_values
        solve = partial(self.fitter.fit, lazy=not bends, max_iterations=_STEPS)
        evidence = self._attempt(solve, start.option, start.robot_values)
        return None if evidence is None else trial(start.option, evidence)

    def _promising(self, starts: Sequence[_Start]) -> list[int]:
        """Return which candidates to fit: at every place the best, where anything is to be gained."""
        left = np.maximum(self.layout.by_axis(self.current - self.floor), 0.0)
        worth = np.maximum(
            self.settings.smallest_gain * self.layout.samples(), self.settings.smallest_score * left
        )
        places = sorted({s.option.effect.axis or 0 for s in starts})
        keep: list[int] = []
        for place in places:
            mine = [i for i, s in enumerate(starts) if (s.option.effect.axis or 0) == place]
            mine.sort(key=lambda i: -starts[i].gain)
            least = _HOPELESS * (worth[place - 1] if place else worth.min())
            best = starts[mine[0]].gain
            keep += [
                i
                for k, i in enumerate(mine)
                if starts[i].gain > least
                and (k < _FITTED or (k < 2 * _FITTED and starts[i].gain > _NEAR * best))
            ]
        # Where nothing is worth a cause, the best of all still say what was looked at.
        return keep or sorted(range(len(starts)), key=lambda i: -starts[i].gain)[:_LOOKED_AT]

    def _each(
        self, pool: ThreadPoolExecutor, work: Callable[[A], B], items: Sequence[A], label: str
    ) -> list[B]:
        out = []
        for k, value in enumerate(pool.map(work, items)):
            out.append(value)
            self.progress(label, k + 1, len(items))
        return out


def _amplitudes(option: FreeEffect) -> set[str]:
    info = effect_info(option.effect.name)
    return {p.name for p in info.parameters if p.role == "amplitude"}


def _size(group: Sequence[FreeEffect]) -> int:
    return sum(len(option.free) for option in group)


def interact(one: int, other: int, axis: int, fall: Array) -> bool:
    """Whether trial ``one``, taken in, would change what ``other`` gains on ``axis``.

    ``fall`` (n_trials, n_axes): what each lowers the loss by.
    """
    return bool(abs(fall[one, axis]) > _FELT * abs(fall[other, axis]))
