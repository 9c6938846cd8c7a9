"""Forward search for causes: screen, fit, rank, add, until nothing more is explained."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.errors import InputError
from axisight.gap.decide import Ranked, Trial, clearly_worse, rank, trial
from axisight.gap.model import Evidence, FreeEffect, ModelFitter
from axisight.gap.score import held_out_loss, linear_gain, predictable
from axisight.gap.settings import Settings

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

# Candidates fitted in full: the best of the screen, and all that come near them.
_FITTED = 10
_NEAR = 0.3


@dataclass(frozen=True)
class Round:
    """One round of the search: the model it started from and the candidates it ranked."""

    start: Evidence
    ranked: list[Ranked]
    accepted: Ranked | None


@dataclass
class Search:
    """Result of a search.

    ``baseline``: the simulator re-fitted without effects; ``model``: with the
    accepted effects; ``floor`` (n_blocks,): loss of noise alone; ``skipped``:
    candidates that failed, with the reason.
    """

    baseline: Evidence
    model: Evidence
    floor: Array
    rounds: list[Round] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)

    @property
    def accepted(self) -> list[Ranked]:
        """The accepted candidates in order of entry."""
        return [r.accepted for r in self.rounds if r.accepted is not None]

    def explained(self) -> float:
        """Return the share of the explainable held-out error the model removes."""
        used = predictable(self.model)
        before = held_out_loss(self.baseline)[used]
        after = held_out_loss(self.model)[used]
        explainable = float((before - self.floor[used]).sum())
        return float((before - after).sum() / explainable) if explainable > 0 else 0.0


def search(
    fitter: ModelFitter,
    candidates: Callable[[Evidence], list[FreeEffect]],
    expected: Array,
    settings: Settings,
    progress: Progress,
) -> Search:
    """Search for the causes of a gap.

    ``candidates`` makes the candidates from the residual of a model;
    ``expected`` (n_axes,) is the mean square of a weighted residual of noise.
    """
    progress("re-fitting the simulator", 0, 1)
    baseline = fitter.fit([])
    progress("re-fitting the simulator", 1, 1)
    floor = expected[baseline.axis] * baseline.size
    out = Search(baseline, baseline, floor)
    for number in range(1, settings.max_causes + 1):
        options = _new(candidates(out.model), out.model)
        trials = _round(fitter, out, options, settings, progress, number)
        current = held_out_loss(out.model)
        ranked = _polished(fitter, trials, current, floor, out.model, progress, number)
        accepted = _acceptable(ranked, out, current, settings, len(options))
        if accepted is not None and not _earns_its_gain(fitter, accepted, out.model):
            accepted = None
        if accepted is not None and _parts_do(accepted, ranked, fitter):
            ranked = _without_composite(ranked)
            accepted = ranked[0]
        out.rounds.append(Round(out.model, ranked, accepted))
        if accepted is None:
            break
        progress(f"adding {accepted.trial.label}", 0, 1)
        start = accepted.trial.evidence
        out.model = fitter.fit(start.free, start, max_iterations=4)
        progress(f"adding {accepted.trial.label}", 1, 1)
        if _settled(out, settings):
            break
    return out


@dataclass(frozen=True)
class _Start:
    """Where the fit of a candidate begins, and the gain it promises."""

    option: FreeEffect
    robot_values: Mapping[str, float]
    gain: float


def _new(options: Sequence[FreeEffect], model: Evidence) -> list[FreeEffect]:
    present = {e.label for e in model.effects}
    return [o for o in options if o.effect.label not in present]


def _round(
    fitter: ModelFitter,
    state: Search,
    options: Sequence[FreeEffect],
    settings: Settings,
    progress: Progress,
    number: int,
) -> list[Trial]:
    """Screen all candidates by one linear step, fit the promising ones in full."""
    model = state.model

    def attempt(
        option: FreeEffect, iterations: int, start: _Start | None = None
    ) -> Evidence | None:
        effects = [*model.free, option if start is None else start.option]
        values = None if start is None else start.robot_values
        try:
            return fitter.fit(
                effects, model, robot_values=values, lazy=True, max_iterations=iterations
            )
        except InputError as error:
            # A candidate that cannot be simulated is out, and the result says so.
            state.skipped[option.effect.label] = str(error)
            return None

    def screened(option: FreeEffect) -> _Start:
        evidence = attempt(option, 0)
        best = _Start(option, model.robot_values, -np.inf)
        if evidence is not None:
            gain = model.total - evidence.total + linear_gain(evidence)
            best = replace(best, gain=gain)
        for values in option.starts:
            # A large effect bends the re-fitted simulator: its own starts begin without.
            start = _Start(option.at(values), {}, -np.inf)
            evidence = attempt(option, 0, start)
            if evidence is not None and model.total - evidence.total > best.gain:
                best = replace(start, gain=model.total - evidence.total)
        return best

    def fitted(start: _Start) -> Trial | None:
        evidence = attempt(start.option, 15, start)
        return None if evidence is None else trial(start.option, evidence)

    with ThreadPoolExecutor(settings.threads) as pool:
        try:
            starts = _each(
                pool, screened, options, progress, f"screening candidates, round {number}"
            )
            keep = _promising(np.array([s.gain for s in starts]))
            chosen = [starts[i] for i in keep]
            trials = _each(pool, fitted, chosen, progress, f"fitting candidates, round {number}")
        except BaseException:
            fitter.cancel.cancel()
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return [t for t in trials if t is not None]


A = TypeVar("A")
B = TypeVar("B")


def _each(
    pool: ThreadPoolExecutor,
    work: Callable[[A], B],
    items: Sequence[A],
    progress: Progress,
    label: str,
) -> list[B]:
    out = []
    for k, value in enumerate(pool.map(work, items)):
        out.append(value)
        progress(label, k + 1, len(items))
    return out


def _promising(gains: Array) -> list[int]:
    order = np.argsort(-gains, kind="stable")
    best = gains[order[0]] if len(order) else 0.0
    keep = [i for k, i in enumerate(order) if k < _FITTED or gains[i] > _NEAR * best]
    return [int(i) for i in keep if np.isfinite(gains[i])]


def _acceptable(
    ranked: Sequence[Ranked], state: Search, current: Array, settings: Settings, tried: int
) -> Ranked | None:
    """Return the winner if what it explains is real and worth naming.

    The winner is the best of ``tried`` candidates: its significance is held
    against the level that keeps the false alarms of all of them together at
    ``settings.false_alarms`` (Bonferroni).
    """
    if not ranked:
        return None
    best = ranked[0]
    gain = float((current - best.trial.held_out).sum())
    size = float(state.model.size.sum())
    first = max(float((held_out_loss(state.baseline) - state.floor).sum()), 1e-12)
    needed = max(
        settings.significance, float(scipy.stats.norm.isf(settings.false_alarms / max(tried, 1)))
    )
    real = best.significance > needed and gain / size > settings.smallest_gain
    worth = best.score > settings.smallest_score and gain / first > settings.smallest_share
    return best if real and worth else None


# Fitted with sensitivities of their own: the leaders of the ranking, unless the
# first already explains nearly everything.
_POLISHED = 2
_GOOD_ENOUGH = 0.95


def _polished(
    fitter: ModelFitter,
    trials: list[Trial],
    current: Array,
    floor: Array,
    model: Evidence,
    progress: Progress,
    number: int,
) -> list[Ranked]:
    """Rank the trials, the leaders fitted again with the simulator's sensitivities renewed.

    A large effect bends the re-fitted simulator, and the sensitivities taken from
    it; the leaders deserve better before one of them is believed.
    """
    ranked = rank(trials, current, floor, model.log)
    if not ranked or ranked[0].score > _GOOD_ENOUGH:
        return ranked
    done: set[str] = set()
    label = f"refining the leaders, round {number}"
    for k in range(_POLISHED):
        ranked = rank(trials, current, floor, model.log)
        todo = [r for r in ranked[:_POLISHED] if r.trial.label not in done]
        if not todo or not _worth_polishing(todo[0], ranked[0]):
            break
        old = todo[0].trial
        progress(label, k, _POLISHED)
        better = fitter.fit(old.evidence.free, old.evidence, max_iterations=3)
        done.add(old.label)
        if better.total < old.evidence.total:
            trials = [trial(old.candidate, better) if t is old else t for t in trials]
    progress(label, _POLISHED, _POLISHED)
    return rank(trials, current, floor, model.log)


def _worth_polishing(candidate: Ranked, leader: Ranked) -> bool:
    """Whether a candidate explains anything, and is not out of the leader's reach."""
    return candidate.score > 0.02 and candidate.score > 0.3 * leader.score


def _first_part(winner: Ranked, ranked: Sequence[Ranked]) -> Ranked | None:
    """Return the rival that is the first part of a winner which simpler effects imitate."""
    effect = winner.trial.candidate.effect
    parts = effect_info(effect.name).parts
    if not parts:
        return None
    label = Effect(parts[0], effect.axis).label
    return next((r for r in ranked if r.trial.label == label), None)


def _parts_do(winner: Ranked, ranked: Sequence[Ranked], fitter: ModelFitter) -> bool:
    """Whether the parts of a composite winner together fit held-out data no worse than it."""
    part = _first_part(winner, ranked)
    if part is None:
        return False
    effect = winner.trial.candidate.effect
    second = effect_info(effect.name).parts[1]
    other = FreeEffect(Effect(second, effect.axis), (effect_info(second).parameters[0].name,))
    try:
        both = fitter.fit([*part.trial.evidence.free, other], part.trial.evidence, lazy=True)
    except InputError:
        return False
    return not clearly_worse(held_out_loss(both).sum(), winner.trial.held_out.sum())


def _without_composite(ranked: Sequence[Ranked]) -> list[Ranked]:
    """Put the first part in the place of its composite, with the probability of both."""
    winner = ranked[0]
    part = _first_part(winner, ranked)
    if part is None:
        return list(ranked)
    merged = replace(part, probability=part.probability + winner.probability)
    return [merged, *(r for r in ranked[1:] if r is not part)]


def _earns_its_gain(fitter: ModelFitter, winner: Ranked, model: Evidence) -> bool:
    """Whether the gain goes away when the effect is switched off again.

    A fit with one more effect also moves everything else; where the model was not
    at its optimum, that may be all it did.
    """
    fitted = winner.trial.evidence
    others = [replace(f, free=()) for f in fitted.free[:-1]]
    without = fitter.fit(
        others, model, robot_values=fitted.robot_values, lazy=True, max_iterations=0
    )
    gain = model.total - fitted.total
    return without.total - fitted.total > 0.5 * gain and not fitter.within_tolerance(
        fitted.effects[-1]
    )


def _settled(state: Search, settings: Settings) -> bool:
    """Whether what is left is within formula error or close to the floor."""
    left = float((held_out_loss(state.model) - state.floor).sum())
    return left / float(state.model.size.sum()) < settings.smallest_gain
