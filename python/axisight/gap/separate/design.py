"""Chooses the motion that answers a question best, whichever answer is true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.fitting.divergence import Diverged
from axisight.gap.facts.experiment import Experiment, Plan
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.separate.question import Question, Seen
from axisight.gap.separate.route import Route, Runs
from axisight.gap.separate.waves import Motion

Array = NDArray[np.float64]

# Motions that are evaluated again one by one, with exact weights.
_FINALISTS = 6
# Rounds in which variants of the best motion are tried.
_ROUNDS = 3
# Smallest and largest number of runs of a motion, and the largest number for the usual motion that is compared. At
# least two, because a diagnosis leaves each log out in turn and does not believe a single run.
_TWICE, _REPEATS, _FOR_EVER = 2, 10, 1000


class _Tried:
    """The motions tried so far, and what they show at the weights of the logs.

    The first ``n_aside`` motions are compared only. ``runs``: of each possible machine along each motion; ``seen``:
    what each motion shows.
    """

    def __init__(
        self, route: Route, question: Question, first: Sequence[Motion], n_aside: int
    ) -> None:
        self._route, self.question, self._n_aside = route, question, n_aside
        self.motions: list[Motion] = list(first)
        self.runs = self._run(first)
        self.seen = self._seen_of(first, self.runs)
        self.question = question.narrowed(self.seen[n_aside:], _REPEATS)

    def add(self, more: Sequence[Motion]) -> None:
        """Run motions and evaluate them together."""
        runs = self._run(more)
        self.runs = [_both(a, b) for a, b in zip(self.runs, runs, strict=True)]
        self.seen += self._seen_of(more, runs)
        self.motions += more

    @property
    def worth(self) -> Array:
        """The worth of each motion (n_motions,) for the question."""
        return np.array([self.question.worth(x) for x in self.seen])

    def best(self, count: int) -> list[int]:
        """Return the best motions that are not compared only, the best first."""
        order = np.argsort(-self.worth, kind="stable")
        return [int(k) for k in order if k >= self._n_aside][:count]

    def alone(self, which: Sequence[int]) -> dict[int, list[Seen]]:
        """Return what some motions show, each with the weights that it gives."""
        return _seen(self._route, self.question, self.runs, which, alone=True)

    def _run(self, motions: Sequence[Motion]) -> list[Runs]:
        """Return the runs of the machine of each turn; a machine of several turns runs once."""
        turns = self.question.turns
        machines = {id(turn.machine): turn.machine for turn in turns}
        runs = {key: self._route.runs(machine, motions) for key, machine in machines.items()}
        return [runs[id(turn.machine)] for turn in turns]

    def _seen_of(self, motions: Sequence[Motion], runs: Sequence[Runs]) -> list[list[Seen]]:
        seen = _seen(self._route, self.question, runs, range(len(motions)), alone=False)
        return [seen[k] for k in range(len(motions))]


def designed(route: Route, question: Question) -> Experiment:
    """Return the motion that answers a question best, with the number of runs that it needs.

    Each possible machine is simulated along each motion. The alternative model is fitted to that run in one linear
    step, with what the logs already say about its parameters as a prior.
    """
    axes = question.axes or tuple(route.view.robot.axis_numbers())
    usual = route.usual_motions()
    aside = 0 if route.offers_usual else len(usual)
    tried = _Tried(route, question, [*usual, *route.motions(axes)], aside)
    for k in range(_ROUNDS):
        if variants := route.improved(tried.motions[tried.best(1)[0]], k):
            tried.add(variants)
    best_usual = int(np.argmax(tried.worth[: len(usual)]))
    finalists = tried.best(_FINALISTS)
    # Weights as they will be with the new log decide between the best motions.
    exact = tried.alone(list(dict.fromkeys([best_usual, *finalists])))
    question = tried.question.narrowed([exact[k] for k in finalists], _REPEATS)
    best = max(finalists, key=lambda k: question.worth(exact[k]))
    repeats = _repeats(question, exact[best], question.enough, _REPEATS)
    expected = question.worth(exact[best], repeats)
    as_much = min(expected, question.enough)
    shorter = _repeats(question, exact[best_usual], as_much, _FOR_EVER) / repeats
    return question.answered(planned(route, tried.motions[best], repeats, shorter), expected)


def planned(route: Route, motion: Motion, repeats: int, times_shorter: float = 1.0) -> Plan:
    """Return the plan of a motion."""
    return Plan(
        motion.words,
        motion.axes,
        route.references(motion),
        route.trajectory(motion),
        repeats,
        times_shorter,
        route.usual,
        route.limits.told(),
    )


def _repeats(question: Question, seen: Sequence[Seen], enough: float, most: int) -> int:
    """Return the number of runs of a motion that reaches a worth of ``enough``, at most ``most``.

    The worth grows with the number of runs, so that the number is found by halving.
    """
    low, high = _TWICE, most
    while low < high:
        middle = (low + high) // 2
        if question.worth(seen, middle) >= enough:
            high = middle
        else:
            low = middle + 1
    return low


def _both(first: Runs, second: Runs) -> Runs:
    return Runs(
        [*first.records, *second.records],
        [*first.torques, *second.torques],
        np.concatenate([first.possible, second.possible]),
    )


def _seen(
    route: Route,
    question: Question,
    runs: Sequence[Runs],
    which: Sequence[int],
    *,
    alone: bool,
) -> dict[int, list[Seen]]:
    """Return what each motion shows for each possible machine; zero for a motion that cannot be run or compared.

    ``alone``: evaluate each motion with the weights from its own torque.
    """
    turns, n_axes = question.turns, route.view.robot.n_axes
    nothing = Seen(np.zeros(n_axes), np.zeros(n_axes), 0.0)
    out = {k: [nothing] * len(turns) for k in which}
    here = [k for k in which if all(r.possible[k] for r in runs)]
    together = [here] if here else []
    groups = [[k] for k in here] if alone else together
    while groups:
        group = groups.pop()
        found = _seen_along(route, question, runs, group, alone=alone)
        if found is not None:
            out |= found
        elif len(group) > 1:
            # A model diverges along one motion at least: halves find out along which.
            groups += [group[: len(group) // 2], group[len(group) // 2 :]]
    return out


def _seen_along(
    route: Route, question: Question, runs: Sequence[Runs], group: Sequence[int], *, alone: bool
) -> dict[int, list[Seen]] | None:
    """Return what each motion of a group shows for each possible machine; None if a model diverges along one."""
    n_axes = route.view.robot.n_axes
    out: dict[int, list[Seen]] = {k: [] for k in group}
    compared: dict[int, _Compared] = {}
    # What a machine shows without the effects in question is the same for all rivals.
    shown: dict[tuple[int, tuple[Hypothesis, ...]], Array] = {}
    for run, turn in zip(runs, question.turns, strict=True):
        machine = id(turn.machine)
        if machine not in compared:
            compared[machine] = _Compared(route.fitter(run, group, alone=alone), n_axes)
        found = compared[machine].left(turn.other, turn.free)
        if found is None:
            return None
        left, samples = found
        key = (machine, turn.neither)
        if key not in shown:
            same = turn.neither == turn.free
            without = found if same else compared[machine].left(turn.other, turn.neither)
            if without is None:
                return None
            shown[key] = without[0]
        for k, a, b, n in zip(group, left, shown[key], samples, strict=True):
            out[k].append(Seen(a, b, n))
    return out


class _Compared:
    """Runs of one machine, to which models are fitted in one linear step.

    The first fit computes the sensitivities to the simulator's own parameters. Later ones reuse them, because rivals
    hardly alter them. On an arm of six axes, they are most of the work.
    """

    def __init__(self, fitter: ModelFitter, n_axes: int) -> None:
        self._fitter, self._n_axes = fitter, n_axes
        self._own: dict[tuple[str | None, str], Any] = {}

    def left(
        self, model: FittedModel, free: Sequence[Hypothesis]
    ) -> tuple[Array, list[float]] | None:
        """Return what a model with the effects ``free`` leaves of each run, as mean squares (n_runs, n_axes).

        The second value is the number of residuals of an axis in each run. None if the model diverges along a run.
        """
        # Sensitivities along other logs cannot be reused.
        start = replace(model, columns=self._own)
        found = self._fitter.fit(
            free,
            start,
            robot_values=model.robot_values,
            lazy=bool(self._own),
            max_iterations=0,
        )
        if isinstance(found, Diverged):
            return None
        own = {
            key: column
            for key, column in found.columns.items()
            if key[0] is None and not self._fitter.bends(key[1])
        }
        self._own = own | self._own
        return _mean_squares(model, found, self._n_axes)


def _mean_squares(model: FittedModel, found: FittedModel, n_axes: int) -> tuple[Array, list[float]]:
    """Return what is left of runs after one linear step from ``found``, with what ``model`` knows as a prior."""
    known = model.matrix.sum(axis=0) + model.prior_matrix
    names = [p for p in found.parameters if p in model.parameters]
    mine = [found.parameters.index(p) for p in names]
    order = [model.parameters.index(p) for p in names]
    held = found.prior_matrix.copy()
    held[np.ix_(mine, mine)] = known[np.ix_(order, order)]
    out, counts = [], []
    for run in range(int(found.log.max()) + 1):
        here = found.log == run
        matrix, gradient = found.matrix[here], found.gradient[here]
        step = -np.linalg.lstsq(matrix.sum(axis=0) + held, gradient.sum(axis=0), rcond=1e-12)[0]
        loss = found.loss[here] + 2 * gradient @ step + np.einsum("bij,i,j->b", matrix, step, step)
        samples = np.bincount(found.axis[here], found.samples[here], n_axes)
        left = np.bincount(found.axis[here], loss, n_axes) / np.maximum(samples, 1.0)
        out.append(np.maximum(left, 0.0))
        counts.append(float(samples.min()))
    return np.array(out), counts
