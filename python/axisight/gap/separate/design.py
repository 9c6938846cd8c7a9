"""Chooses the motion that answers a question best, whichever answer is true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.excitation import References
from axisight.fitting.divergence import must_hold
from axisight.gap.facts.experiment import Experiment, Plan
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.separate.question import Question, Seen, Turn
from axisight.gap.separate.waves import Motion, Range, motions, standard
from axisight.gap.simulator.own_parameters import with_values
from axisight.gap.views.closed_loop import ClosedLoopFitter, ClosedLoopView, Record
from axisight.simulation import simulate_batch

Array = NDArray[np.float64]

# Largest torque of a motion, relative to the largest one seen or allowed.
_MARGIN = 1.05
# Motions that are evaluated again one by one, with exact weights.
_FINALISTS = 6
# Smallest and largest number of runs of a motion, and the largest number for the standard motion that is compared. At
# least two, because a diagnosis leaves each log out in turn and does not believe a single run.
_TWICE, _REPEATS, _FOR_EVER = 2, 10, 1000


@dataclass(frozen=True, eq=False)
class _Runs:
    """Simulated runs of a machine along every motion, and whether its torque stays within the limits.

    ``records``: motor angles and torques (n, n_axes) of each motion; ``possible`` (n_motions,).
    """

    records: list[Record]
    possible: NDArray[np.bool_]


def designed(view: ClosedLoopView, question: Question, limits: Range) -> Experiment:
    """Return the motion within ``limits`` that answers a question best, with the number of runs that it needs.

    Each possible machine is simulated along each motion. The alternative model is fitted to that run in one linear
    step, with what the logs already say about its parameters as a prior.
    """
    widest = 0.8 * min(view.settings.bandwidth_hz, 0.5 / view.robot.sample_time_s)
    time, seed = view.robot.sample_time_s, view.settings.seed
    axes = question.axes or tuple(view.robot.axis_numbers())
    usual = standard(limits, time, seed)
    tried = [*usual, *motions(limits, axes, time, widest, seed)]
    runs = [_runs(view, turn.machine, tried, limits.torque) for turn in question.turns]
    rough = _seen(view, question.turns, runs, range(len(tried)), alone=False)
    worth = np.array([question.worth(rough[k]) for k in range(len(tried))])
    best_usual = int(np.argmax(worth[: len(usual)]))
    order = np.argsort(-worth, kind="stable")[:_FINALISTS]
    # Weights as they will be with the new log decide between the best motions.
    finalists = list(dict.fromkeys([best_usual, *order.tolist()]))
    exact = _seen(view, question.turns, runs, finalists, alone=True)
    best = max(finalists, key=lambda k: question.worth(exact[k]))
    repeats = _repeats(question, exact[best], question.enough, _REPEATS)
    expected = question.worth(exact[best], repeats)
    as_much = min(expected, question.enough)
    chosen = tried[best]
    design = {"motion": chosen.words, "seed": seed}
    plan = Plan(
        chosen.words,
        chosen.axes,
        References(time, chosen.reference[None], design=design),
        repeats,
        _repeats(question, exact[best_usual], as_much, _FOR_EVER) / repeats,
    )
    return question.answered(plan, expected)


def _repeats(question: Question, seen: Sequence[Seen], enough: float, most: int) -> int:
    """Return the number of runs of a motion that reaches a worth of ``enough``, at most ``most``."""
    tried = (r for r in range(_TWICE, most) if question.worth(seen, r) >= enough)
    return next(tried, most)


def _runs(
    view: ClosedLoopView, machine: FittedModel, tried: Sequence[Motion], most: Array
) -> _Runs:
    robot = with_values(view.robot, machine.robot_values)
    out = simulate_batch(
        robot,
        np.stack([m.reference for m in tried]),
        effects=list(machine.effects),
        method="rk4",
        threads=view.settings.threads,
    )
    angle, torque = out["position_rad"].values, out["torque_cmd_nm"].values
    # A run that diverged is NaN, and counts as infinite torque.
    size = np.nan_to_num(np.abs(torque), nan=np.inf).max(axis=1)
    records: list[Record] = [
        (np.ascontiguousarray(q), np.ascontiguousarray(u), np.ones_like(u), None, 0)
        for q, u in zip(angle, torque, strict=True)
    ]
    return _Runs(records, (size <= _MARGIN * most).all(axis=1))


def _seen(
    view: ClosedLoopView,
    turns: Sequence[Turn],
    runs: Sequence[_Runs],
    which: Sequence[int],
    *,
    alone: bool,
) -> dict[int, list[Seen]]:
    """Return what each motion shows for each possible machine; zero for a motion that cannot be run.

    ``alone``: evaluate each motion with the weights from its own torque.
    """
    n_axes = view.robot.n_axes
    nothing = Seen(np.zeros(n_axes), np.zeros(n_axes), 0.0)
    out = {k: [nothing] * len(turns) for k in which}
    here = [k for k in which if all(r.possible[k] for r in runs)]
    together = [here] if here else []
    for place, (run, turn) in enumerate(zip(runs, turns, strict=True)):
        for group in [[k] for k in here] if alone else together:
            own = view.weighting_with(run.records[group[0]][1]) if alone else None
            fitter = view.fitter.along([run.records[k] for k in group], own)
            left, samples = _left(fitter, turn.other, turn.free, n_axes)
            there = left
            if turn.neither != turn.free:
                there, _ = _left(fitter, turn.other, turn.neither, n_axes)
            for k, a, b in zip(group, left, there, strict=True):
                out[k][place] = Seen(a, b, samples)
    return out


def _left(
    fitter: ClosedLoopFitter, model: FittedModel, free: Sequence[Hypothesis], n_axes: int
) -> tuple[Array, float]:
    """Return what a model with the effects ``free`` leaves of each run, as mean squares (n_runs, n_axes).

    The second value is the number of residuals of an axis.
    """
    # Sensitivities along other logs cannot be reused.
    start = replace(model, columns={})
    values = model.robot_values
    found = must_hold(fitter.fit(free, start, robot_values=values, max_iterations=0))
    known = model.matrix.sum(axis=0) + model.prior_matrix
    names = [p for p in found.parameters if p in model.parameters]
    mine = [found.parameters.index(p) for p in names]
    order = [model.parameters.index(p) for p in names]
    held = found.prior_matrix.copy()
    held[np.ix_(mine, mine)] = known[np.ix_(order, order)]
    out = []
    for run in range(int(found.log.max()) + 1):
        here = found.log == run
        matrix, gradient = found.matrix[here], found.gradient[here]
        step = -np.linalg.lstsq(matrix.sum(axis=0) + held, gradient.sum(axis=0), rcond=1e-12)[0]
        loss = found.loss[here] + 2 * gradient @ step + np.einsum("bij,i,j->b", matrix, step, step)
        samples = np.bincount(found.axis[here], found.samples[here], n_axes)
        out.append(np.maximum(np.bincount(found.axis[here], loss, n_axes) / samples, 0.0))
    return np.array(out), float(samples.min())
