"""Forward search for causes: screen, fit, rank, add, until nothing more is explained."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.decide import Ranked, Trial, rank, trial
from axisight.gap.model import Evidence, FreeEffect, ModelFitter
from axisight.gap.score import held_out_loss, linear_gain
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
        before = held_out_loss(self.baseline)
        after = held_out_loss(self.model)
        explainable = float((before - self.floor).sum())
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
        ranked = rank(trials, current, floor, out.model.log)
        accepted = _acceptable(ranked, out, current, settings)
        out.rounds.append(Round(out.model, ranked, accepted))
        if accepted is None:
            break
        progress(f"adding {accepted.trial.label}", 0, 1)
        out.model = fitter.fit(accepted.trial.evidence.free, accepted.trial.evidence)
        progress(f"adding {accepted.trial.label}", 1, 1)
        if _settled(out, settings):
            break
    return out


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

    def attempt(option: FreeEffect, iterations: int) -> Evidence | None:
        try:
            return fitter.fit([*model.free, option], model, lazy=True, max_iterations=iterations)
        except InputError as error:
            # A candidate that cannot be simulated is out, and the result says so.
            state.skipped[option.effect.label] = str(error)
            return None

    def screened(option: FreeEffect) -> float:
        evidence = attempt(option, 0)
        return -np.inf if evidence is None else model.total - evidence.total + linear_gain(evidence)

    def fitted(option: FreeEffect) -> Trial | None:
        evidence = attempt(option, 15)
        return None if evidence is None else trial(option, evidence)

    with ThreadPoolExecutor(settings.threads) as pool:
        try:
            gains = _each(pool, screened, options, progress, f"screening candidates, round {number}")
            keep = _promising(np.array(gains, dtype=float))
            chosen = [options[i] for i in keep]
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
    ranked: Sequence[Ranked], state: Search, current: Array, settings: Settings
) -> Ranked | None:
    """Return the winner if what it explains is real and worth naming."""
    if not ranked:
        return None
    best = ranked[0]
    gain = float((current - best.trial.held_out).sum())
    size = float(state.model.size.sum())
    first = max(float((held_out_loss(state.baseline) - state.floor).sum()), 1e-12)
    real = best.significance > settings.significance and gain / size > settings.smallest_gain
    worth = best.score > settings.smallest_score and gain / first > settings.smallest_share
    return best if real and worth else None


def _settled(state: Search, settings: Settings) -> bool:
    """Whether what is left is within formula error or close to the floor."""
    left = float((held_out_loss(state.model) - state.floor).sum())
    return left / float(state.model.size.sum()) < settings.smallest_gain
