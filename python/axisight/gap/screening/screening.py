"""Screening: one linear step for every hypothesis gives its predicted gain and the start of its fit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
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

# Free parameters of candidates that are screened in one evaluation: the core takes this many derivatives at once.
_TOGETHER = 4
# Largest number of evaluations between two start values of an effect.
_SCANS = 10
# Share of the loss that the first start must promise if it has an effect, and that the loss must differ by between the
# smallest and the largest start: each further start costs a simulation.
_LEAST_GAIN = 0.002
# The logs of the last screening stay in use if they hold this share of the error that the same number of logs can hold.
_NEARLY = 0.8
# First halves of the logs suffice for screening if they hold this share of the loss above the floor, on every axis
# whose mean square above the floor exceeds 0.05 of the noise.
_THEIR_PART = 0.35
_SOMETHING = 0.05
# Number of logs that the core simulates in lock-step: fewer cost as much.
_LOCK_STEP = 4


def kept_beside(free: Sequence[Hypothesis], new: Hypothesis) -> list[Hypothesis]:
    """Return the effects of a model without those that a new effect contains on the same axis."""
    contains = effect_info(new.effect.name).contains
    return [f for f in free if f.effect.name not in contains or f.effect.axis != new.effect.axis]


@dataclass(frozen=True)
class Start:
    """Where the fit of a candidate begins, and the gain that it promises.

    - ``gain``: predicted fall of the loss.
    - ``falls`` (n_axes,): fall by axis, for effects of the whole arm.
    - ``at_home``: fall on the candidate's own axis, for effects of one axis.
    - ``sensitivity``: for candidates whose start values have no effect.
    """

    option: Hypothesis
    robot_values: Mapping[str, float]
    gain: float
    falls: Array | None = None
    sensitivity: Sensitivity | None = None
    at_home: float | None = None


class ScreeningModel:
    """A model to which candidates are added, with its simulated runs, which speed up nearby simulations.

    ``skipped``: candidates that cannot be simulated, with the reason.
    """

    def __init__(self, fitter: ModelFitter, model: FittedModel) -> None:
        self.fitter, self.model = fitter, model
        self.near_nominal: Courses | None = None
        self.skipped: dict[str, str] = {}

    @cached_property
    def near(self) -> Courses | None:
        """Simulated runs of the model; None if there are none."""
        return self._runs(self.model.robot_values)

    def begin_nominal(self) -> None:
        """Simulate the model at nominal own parameters, for candidates that start there.

        If that simulation diverges, these candidates are tried without runs to start from.
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
        """Return the result of ``solve``, a method of the fitter, for a candidate; None if it diverges.

        ``values``: start of the own parameters, by default the model's; ``close``: they stay near the model's.
        ``beside``: the other effects, by default those of the model.
        """
        others = kept_beside(self.model.free, option) if beside is None else beside
        effects = [*others, option]
        # Stored runs help only if own parameters equal those of the runs or are close to them.
        as_model = close or values is None or values == self.model.robot_values
        near = self.near if as_model else self.near_nominal
        found = solve(effects, self.model, robot_values=values, near=near)
        if isinstance(found, Diverged):
            self.skipped[option.effect.label] = str(found)
            return None
        return found


class Screening:
    """Screening of one model.

    If the bench has only part of the data: ``scale`` converts gains and ``more`` amounts of data to the whole.
    ``kept``: cache for the sensitivities of candidates whose start values have no effect.
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
        # Gain of one step of the simulator's own parameters to their best values on these logs.
        self._own, self._own_falls = linear_gain(self.model), linear_falls(self.model)

    def from_kept(self) -> CachedScreening:
        """Return a screening that uses cached sensitivities only."""
        return CachedScreening(self.bench, self.scale, self.more, self.kept)

    def idle(self, option: Hypothesis) -> bool:
        """Whether adding a candidate at its start values leaves the model unchanged."""
        beside = kept_beside(self.model.free, option)
        return not option.effect.acts and len(beside) == len(self.model.free)

    def felt(self, option: Hypothesis) -> Hypothesis:
        """Return a candidate with those parameters free that change the model at its start values.

        The shape of an effect that is not there changes nothing.
        """
        sizes = _amplitudes_free(option)
        return replace(option, free=sizes) if sizes and self.idle(option) else option

    def groups(self, options: Sequence[Hypothesis]) -> list[list[Hypothesis]]:
        """Return the candidates grouped by evaluation: those without effect at their start values share one."""
        sized = [(len(self.felt(option).free), option) for option in options]
        fits = [self.idle(option) and size <= _TOGETHER for size, option in sized]
        alone = [[option] for option, shares in zip(options, fits, strict=True) if not shares]
        together = [one for one, shares in zip(sized, fits, strict=True) if shares]
        groups: list[list[Hypothesis]] = []
        left: list[int] = []
        for size, option in sorted(together, key=lambda one: -one[0]):
            at = next((i for i, room in enumerate(left) if size <= room), len(groups))
            if at == len(groups):
                groups.append([])
                left.append(_TOGETHER)
            groups[at].append(option)
            left[at] -= size
        return alone + groups

    def starts(self, group: list[Hypothesis]) -> list[Start]:
        """Return the best start of each candidate of a group, with its predicted gain."""
        found = self._shared(group)
        best = (self._best_start(o, e) for o, e in zip(group, found, strict=True))
        return [self._scaled(start) for start in best]

    def sensitivities(self, group: list[Hypothesis]) -> list[Sensitivity]:
        """Return the sensitivities of those candidates of a group whose start values have no effect."""
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
        """Return the normal equations of the model with each candidate, with as many per evaluation as possible."""
        return [found for group in self.groups(options) for found in self._shared(group)]

    def _shared(self, group: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        """Return the normal equations of the model with each candidate of a group; None for those that diverge."""
        felt = [self.felt(option) for option in group]
        found = self._run(felt)
        for option, fitted in zip(felt, found, strict=True):
            lasting = self.idle(option) and self.fitter.lasting(option)
            if fitted is not None and lasting:
                self.kept.keep(option, fitted)
        return found

    def _run(self, group: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        if len(group) > 1:
            together = self.fitter.evaluate_each(group, self.model, self.bench.near)
            # If one candidate diverges, each is evaluated alone.
            if not isinstance(together, Diverged):
                return list(together)
        return [self.bench.attempt(self.fitter.evaluate, o, None) for o in group]

    def _best_start(self, option: Hypothesis, fitted: NormalEquations | None) -> Start:
        best = self._start(option, fitted)
        # A candidate with an effect at its start values costs one simulation for every start.
        hopeless = option.effect.acts and best.gain < _LEAST_GAIN * self.model.total
        if len(option.free) > 1 and not hopeless:
            # Compare further starts by the gain that one linear step promises.
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
        """Return a candidate at its further start values, with only its amplitudes free."""
        sizes = replace(option, free=_amplitudes_free(option))
        return [sizes.at(option.at(v).effect.parameters or {}) for v in option.starts]

    def _start(self, option: Hypothesis, fitted: NormalEquations | None) -> Start:
        """Return a candidate with the gain that one linear step from ``fitted`` promises."""
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
        """Return the candidate at the best of its start values, with its gain there.

        A large effect distorts the re-fit, so these starts use nominal own parameters. If no start gains anything with
        these, the re-fitted ones are used.
        """
        first = self._scanned(option, {})
        return first if first.gain > 0 else self._scanned(option, self.model.robot_values)

    def _scanned(self, option: Hypothesis, robot_values: Mapping[str, float]) -> Start:
        """Return the best start of a candidate with one free parameter, over all sets of its other start values."""
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
        """Return the best start of a candidate with one free parameter, searched at ``begin`` and between.

        If the smallest and the largest value have nearly the same loss, the effect hardly acts: a gear that is always
        loaded shows no play, however wide.
        """
        name = option.free[0]

        @cache
        def loss(value: float) -> float:
            found = self.bench.attempt(self.fitter.loss, option.at({name: value}), robot_values)
            return np.inf if found is None else found

        values = sorted(begin)
        first, last = loss(values[0]), loss(values[-1])
        if abs(last - first) <= _LEAST_GAIN * first < np.inf:
            return Start(option.at({name: values[0]}), robot_values, self.model.total - first)
        losses = [loss(v) for v in values]
        at = int(np.argmin(losses))
        least, value = losses[at], values[at]
        if least < self.model.total:
            # The minimum is narrower than the distance between starts.
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
    """Screening from the cached sensitivities of an earlier model, without simulation."""

    def __init__(self, bench: ScreeningModel, scale: float, more: float, kept: ColumnCache) -> None:
        super().__init__(bench, scale, more, kept)
        self._bordered = Bordered(self.model)

    def knows(self, option: Hypothesis) -> bool:
        """Whether the cache has everything that the screening of a candidate needs."""
        scanned = bool(option.starts) and len(option.free) == 1
        wanted = [option, *self._at_starts(option)]
        known = all(self.kept.rows(self.felt(o)) is not None for o in wanted)
        return known and self.idle(option) and not scanned

    def _shared(self, group: Sequence[Hypothesis]) -> list[NormalEquations | None]:
        return [self._with(option) for option in group]

    def _with(self, candidate: Hypothesis) -> NormalEquations | None:
        option = self.felt(candidate)
        rows = self.kept.rows(option)
        if rows is None:
            return None
        return self._bordered.with_candidate(option, rows, self.fitter.replaced([option]))


def thinned(
    bench: ScreeningModel, above: Array, layout: Layout, kept: ColumnCache | None = None
) -> Screening:
    """Return the screening of a model on part of the data: the logs with the largest error, or their first halves.

    ``above`` (n_blocks,): loss above the floor; ``kept``: cache of sensitivities from earlier models.
    """
    logs = loudest_logs(above, layout, [] if kept is None else kept.logs)
    here = np.isin(layout.log, logs)
    part = bench if here.all() else ScreeningModel(bench.fitter.part(logs), bench.model.part(logs))
    first = here & _first_halves(layout)
    begun = part.fitter.begun(part.model) if _halves_suffice(above, here, first, layout) else None
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
    # The blocks of one axis of a log are in the order of time.
    for place in places:
        first.append(left[place] > 0)
        left[place] -= 1
    return np.array(first)


def _halves_suffice(above: Array, here: Mask, first: Mask, layout: Layout) -> bool:
    """Whether the first halves (``first``) of the logs in use (``here``) hold enough of the loss on every axis.

    They miss an effect that shows late in a log, such as a stall or a warm-up. ``above`` (n_blocks,): loss above the
    floor.
    """
    whole, part = (layout.by_axis(np.where(mask, above, 0.0)) for mask in (here, first))
    counts = whole > _SOMETHING * layout.by_axis(np.where(here, layout.counted, 0.0))
    return bool(np.all(part[counts] > _THEIR_PART * whole[counts]))


def loudest_logs(above: Array, layout: Layout, before: Sequence[int] = ()) -> list[int]:
    """Return the logs to screen on: at least half of them, those with the largest loss above the floor.

    The number is a multiple of the lock-step size, which costs no more. ``above`` (n_blocks,): loss above the floor;
    every axis has the same weight. The logs ``before`` are kept if they hold nearly as much.
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


def _amplitudes_free(option: Hypothesis) -> tuple[str, ...]:
    """Return the free parameters of a candidate that are amplitudes."""
    info = effect_info(option.effect.name)
    sizes = {p.name for p in info.parameters if p.role == "amplitude"}
    return tuple(name for name in option.free if name in sizes)
