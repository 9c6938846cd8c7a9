"""The screen: what every candidate promises by one linear step, and where its fit begins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from axisight._core import Courses
from axisight.effects import effect_info
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis, NormalEquations
from axisight.gap.fit.held_out import linear_falls, linear_gain
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.sensitivity import Sensitivity, sensitivity
from axisight.gap.screening.column_cache import Bordered, ColumnCache

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
A = TypeVar("A")

# Parameters of candidates that are screened together: the core takes so many derivatives at once.
_TOGETHER = 4
# Evaluations between two starts of an effect.
_SCANS = 10
# Share of the loss that the first start of a candidate has to promise where others are dear.
_LEAST_GAIN = 0.002
# Share of the most that there is to explain in as many logs, where others stay the ones to screen on.
_NEARLY = 0.8
# Beginnings of logs do for a screen where they have this share of what there is on every axis that
# has anything, a mean square of so much.
_THEIR_PART = 0.35
_SOMETHING = 0.05
# Logs that the core runs in lock-step: fewer cost as much.
_LOCK_STEP = 4


def kept_beside(free: Sequence[Hypothesis], new: Hypothesis) -> list[Hypothesis]:
    """Return the effects of a model without those that a new one contains at the same place."""
    contains = effect_info(new.effect.name).contains
    return [f for f in free if f.effect.name not in contains or f.effect.axis != new.effect.axis]


@dataclass(frozen=True)
class Start:
    """Where the fit of a candidate begins, and the gain it promises.

    ``falls`` (n_axes,): by axis, of one that acts on the whole arm; ``at_home``: what of the gain is on its
    axis, of one that has one; ``sensitivity``: of one that does nothing as it is.
    """

    option: Hypothesis
    robot_values: Mapping[str, float]
    gain: float
    falls: Array | None = None
    sensitivity: Sensitivity | None = None
    at_home: float | None = None


class ScreeningModel:
    """A model that candidates are tried on, with its runs, which those close to it follow.

    Candidates that cannot be simulated are out; ``skipped`` has them with the reason.
    """

    def __init__(self, fitter: ModelFitter, model: FittedModel) -> None:
        self.fitter, self.model = fitter, model
        self.near_nominal: Courses | None = None
        self.skipped: dict[str, str] = {}

    @cached_property
    def near(self) -> Courses | None:
        """Runs of the model."""
        return self._runs(self.model.robot_values)

    def begin_nominal(self) -> None:
        """Get ready for candidates that begin at the nominal values of the simulator's own parameters.

        Where it cannot be simulated with these alone, candidates are tried without runs to follow.
        """
        self.near_nominal = self._runs({})

    def _runs(self, values: Mapping[str, float]) -> Courses | None:
        runs = self.fitter.runs(self.model, values)
        return None if isinstance(runs, Diverged) else runs

    def attempt(
        self,
        solve: Callable[..., A | Diverged],
        option: Hypothesis,
        values: Mapping[str, float] | None,
        *,
        beside: Sequence[Hypothesis] | None = None,
        close: bool = False,
    ) -> A | None:
        """Return what ``solve`` of the fitter makes of a candidate; None where it cannot.

        ``values``: where the simulator's own parameters begin, the model's unless given; ``close``: near
        the model's. ``beside``: the other effects, those of the model unless given.
        """
        others = kept_beside(self.model.free, option) if beside is None else beside
        effects = [*others, option]
        # Runs serve where the simulator's own parameters are those of the runs, or near them.
        as_model = close or values is None or values == self.model.robot_values
        near = self.near if as_model else self.near_nominal
        found = solve(effects, self.model, robot_values=values, near=near)
        if isinstance(found, Diverged):
            self.skipped[option.effect.label] = str(found)
            return None
        return found


class Screening:
    """The screen of one model.

    Where the bench has only some of the logs, ``scale`` is that of gains, ``more`` of data. What
    candidates that do nothing as they are do to the error goes to ``kept``.
    """

    def __init__(
        self,
        bench: ScreeningModel,
        scale: float = 1.0,
        more: float = 1.0,
        kept: ColumnCache | None = None,
    ) -> None:
        self.bench, self.scale, self.more = bench, scale, more
        self.fitter, self.model = bench.fitter, bench.model
        self.kept = ColumnCache() if kept is None else kept
        # What the simulator's own parameters gain by a step to what is best on these logs.
        self._own, self._own_falls = linear_gain(self.model), linear_falls(self.model)

    def from_kept(self) -> CachedScreening:
        """Return the screen by what was kept."""
        return CachedScreening(self.bench, self.scale, self.more, self.kept)

    def idle(self, option: Hypothesis) -> bool:
        """Whether a candidate does nothing to the model as it is."""
        beside = kept_beside(self.model.free, option)
        return not option.effect.acts and len(beside) == len(self.model.free)

    def groups(self, options: Sequence[Hypothesis]) -> list[list[Hypothesis]]:
        """Return the candidates by evaluation: those that do nothing as they are share one."""
        alone: list[Hypothesis] = []
        together: list[Hypothesis] = []
        for option in options:
            few = len(option.free) <= _TOGETHER
            (together if self.idle(option) and few else alone).append(option)
        groups: list[list[Hypothesis]] = []
        for option in sorted(together, key=lambda o: -len(o.free)):
            room = (g for g in groups if _size(g) + len(option.free) <= _TOGETHER)
            group = next(room, None)
            if group is None:
                groups.append([option])
            else:
                group.append(option)
        return [[option] for option in alone] + groups

    def starts(self, group: list[Hypothesis]) -> list[Start]:
        """Return where fits of the candidates would begin, and what they promise."""
        found = self._shared(group)
        best = (self._best_start(o, e) for o, e in zip(group, found, strict=True))
        return [self._scaled(start) for start in best]

    def sensitivities(self, group: list[Hypothesis]) -> list[Sensitivity]:
        """Return the sensitivities of candidates, of those that do nothing as they are."""
        found = zip(group, self._shared(group), strict=True)
        known = [sensitivity(o, e, self.model.axis) for o, e in found if e is not None]
        return [s.scaled(self.more) for s in known if s is not None]

    def _scaled(self, start: Start) -> Start:
        falls = None if start.falls is None else self.scale * start.falls
        known = None if start.sensitivity is None else start.sensitivity.scaled(self.more)
        home = None if start.at_home is None else self.scale * start.at_home
        gain = self.scale * start.gain
        return replace(start, gain=gain, falls=falls, sensitivity=known, at_home=home)

    def _evaluated(self, options: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        """Return the model with each of several candidates of one size, as many at a time as go."""
        return [found for group in self.groups(options) for found in self._shared(group)]

    def _shared(self, group: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        """Return the model with each of a group, by one evaluation if they allow it."""
        found = self._run(group)
        for option, fitted in zip(group, found, strict=True):
            if fitted is not None and self.idle(option):
                self.kept.keep(option, fitted)
        return found

    def _run(self, group: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        if len(group) > 1:
            together = self.fitter.evaluate_each(group, self.model, self.bench.near)
            # One that cannot be simulated leaves all to be tried alone.
            if not isinstance(together, Diverged):
                return list(together)
        return [self.bench.attempt(self.fitter.evaluate, o, None) for o in group]

    def _best_start(self, option: Hypothesis, fitted: NormalEquations | None) -> Start:
        best = self._start(option, fitted)
        # One that acts as it is costs a run of its own for every start.
        hopeless = option.effect.acts and best.gain < _LEAST_GAIN * self.model.total
        if len(option.free) > 1 and not hopeless:
            # Further starts, by what a step from there promises.
            begins = [option.at(values) for values in option.starts]
            others = self._evaluated(self._at_starts(option))
            starts = (self._start(b, e) for b, e in zip(begins, others, strict=True))
            known = best.sensitivity
            best = max((best, *starts), key=lambda start: start.gain)
            best = replace(best, sensitivity=known)
        elif option.starts and len(option.free) == 1:
            found = self.best_of_starts(option)
            if found.gain > best.gain:
                best = replace(found, sensitivity=best.sensitivity)
        return best

    def _at_starts(self, option: Hypothesis) -> list[Hypothesis]:
        """Return a candidate at its further starts.

        Only sizes: where one does nothing as it is, its shape shows nothing.
        """
        sizes = replace(option, free=tuple(n for n in option.free if n in _amplitudes(option)))
        return [sizes.at(option.at(v).effect.parameters or {}) for v in option.starts]

    def _start(self, option: Hypothesis, fitted: NormalEquations | None) -> Start:
        """Return a candidate with what one linear step promises where ``fitted`` has it."""
        if fitted is None:
            return Start(option, self.model.robot_values, -np.inf)
        gain = self.model.total - fitted.total + linear_gain(fitted) - self._own
        fall = self.model.loss - fitted.loss + linear_falls(fitted) - self._own_falls
        falls = np.bincount(self.model.axis, fall).astype(np.float64)
        known = sensitivity(option, fitted, self.model.axis)
        start = Start(option, self.model.robot_values, gain, sensitivity=known)
        if option.effect.axis is None:
            return replace(start, falls=falls)
        return replace(start, at_home=float(falls[option.effect.axis - 1]))

    def best_of_starts(self, option: Hypothesis) -> Start:
        """Return the candidate at the best of its own starts, and what it gains there.

        A large effect bends the re-fitted simulator: these begin with one that is not re-fitted. Where none
        of them gains anything with that, the re-fitted one was nearer the truth.
        """
        first = self._scanned(option, {})
        return first if first.gain > 0 else self._scanned(option, self.model.robot_values)

    def _scanned(self, option: Hypothesis, robot_values: Mapping[str, float]) -> Start:
        """Return it at the best value of its one number, for each of what starts have beside that."""
        name = option.free[0]
        kinds: dict[frozenset[tuple[str, float]], list[float]] = {}
        for start in option.starts:
            beside = frozenset((k, v) for k, v in start.items() if k != name)
            kinds.setdefault(beside, []).append(start[name])
        found = (self._along(option.at(dict(k)), v, robot_values) for k, v in kinds.items())
        return max(found, key=lambda start: start.gain)

    def _along(
        self, option: Hypothesis, begin: Sequence[float], robot_values: Mapping[str, float]
    ) -> Start:
        """Return it at the best value of its one number, looked for among and between those to ``begin`` at."""
        name = option.free[0]

        def loss(value: float) -> float:
            found = self.bench.attempt(self.fitter.loss, option.at({name: value}), robot_values)
            return np.inf if found is None else found

        values = sorted(begin)
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
        return Start(option.at({name: value}), robot_values, self.model.total - least)


class CachedScreening(Screening):
    """The screen of a model by what candidates did to the error of one before it."""

    def __init__(self, bench: ScreeningModel, scale: float, more: float, kept: ColumnCache) -> None:
        super().__init__(bench, scale, more, kept)
        self._bordered = Bordered(self.model)

    def knows(self, option: Hypothesis) -> bool:
        """Whether all that a candidate is screened by was kept."""
        scanned = bool(option.starts) and len(option.free) == 1
        wanted = [option, *self._at_starts(option)]
        known = all(self.kept.rows(o) is not None for o in wanted)
        return known and self.idle(option) and not scanned

    def _shared(self, group: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        return [self._with(option) for option in group]

    def _with(self, option: Hypothesis) -> NormalEquations | None:
        rows = self.kept.rows(option)
        if rows is None:
            return None
        return self._bordered.with_candidate(option, rows, self.fitter.replaced([option]))


def thinned(
    bench: ScreeningModel, above: Array, layout: Layout, kept: ColumnCache | None = None
) -> Screening:
    """Return the screen of a model on part of what a bench has: beginnings of the loudest logs.

    ``above`` (n_blocks,): loss above the floor; ``kept``: what models before it have left.
    """
    logs = loudest_logs(above, layout, [] if kept is None else kept.logs)
    here = np.isin(layout.log, logs)
    part = bench if here.all() else ScreeningModel(bench.fitter.part(logs), bench.model.part(logs))
    first = here & _first_halves(layout)
    begun = part.fitter.begun(part.model) if _tell(above, here, first, layout) else None
    if begun is not None:
        part, here = ScreeningModel(*begun), first
    if kept is not None:
        kept.begin(logs, halved=begun is not None)
    if part is bench:
        return Screening(bench, kept=kept)
    scale = float(above.sum() / max(above[here].sum(), 1e-300))
    more = float(layout.counted.sum() / max(layout.counted[here].sum(), 1e-300))
    return Screening(part, max(scale, 1.0), more, kept)


def _first_halves(layout: Layout) -> Mask:
    """Return which blocks (n_blocks,) lie in the first halves of their logs."""
    places = list(zip(layout.log.tolist(), layout.axis.tolist(), strict=True))
    left = {place: -(-count // 2) for place, count in Counter(places).items()}
    first = []
    # Those of an axis of a log stand in the order of time.
    for place in places:
        first.append(left[place] > 0)
        left[place] -= 1
    return np.array(first)


def _tell(above: Array, here: Mask, first: Mask, layout: Layout) -> bool:
    """Whether the blocks ``first`` of those ``here`` have their part of what there is on every axis.

    What opens, stalls or warms up late is not in them.
    """
    whole, part = (layout.by_axis(np.where(mask, above, 0.0)) for mask in (here, first))
    counts = whole > _SOMETHING * layout.by_axis(np.where(here, layout.counted, 0.0))
    return bool(np.all(part[counts] > _THEIR_PART * whole[counts]))


def loudest_logs(above: Array, layout: Layout, before: Sequence[int] = ()) -> list[int]:
    """Return the logs to screen on: at least half of them, with most of what is to be explained.

    ``above`` (n_blocks,): loss above the floor. Every axis counts alike. As many as run in
    lock-step at the cost of fewer. Those of ``before`` where they have nearly as much.
    """
    logs = np.unique(layout.log)
    count = _LOCK_STEP * -(-len(logs) // (2 * _LOCK_STEP))
    share = np.zeros(len(logs))
    for axis in range(layout.n_axes):
        here = [float(above[(layout.axis == axis) & (layout.log == log)].sum()) for log in logs]
        share += np.maximum(here, 0.0) / max(sum(np.maximum(here, 0.0)), 1e-300)
    most = np.argsort(-share, kind="stable")[:count]
    if len(before) == count and share[np.isin(logs, before)].sum() > _NEARLY * share[most].sum():
        return list(before)
    return sorted(int(log) for log in logs[most])


def _amplitudes(option: Hypothesis) -> set[str]:
    info = effect_info(option.effect.name)
    return {p.name for p in info.parameters if p.role == "amplitude"}


def _size(group: Sequence[Hypothesis]) -> int:
    return sum(len(option.free) for option in group)
