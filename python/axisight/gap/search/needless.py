"""Proposes to remove causes: those that others made needless, and those that *unknown* may explain better."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from axisight.effects import effect_info
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.fit.held_out import linear_gain
from axisight.gap.search.contest import Context, Proposal


def needless(context: Context) -> Iterator[Proposal]:
    """Propose the set without one cause, for causes that remove too little by a linear step, the least first.

    Not where the cause is sure for any bodies of the arm.

    Causes of the family of an effect of the whole arm are always proposed. A payload that was added beside a wrong
    centre of mass settles elsewhere, further away than one linear step predicts.
    """
    free = context.state.model.free
    if len(free) < 2:
        return
    taken = np.array([_taken_away(context, f) for f in free])
    for i in np.argsort(taken):
        if taken[i] <= context.settings.smallest_gain and not free[i].sure:
            yield _without(free[i])
    families = {effect_info(f.effect.name).family for f in free if f.effect.place is None}
    for f in free:
        if (
            f.effect.axis is not None
            and effect_info(f.effect.name).family in families
            and not f.sure
        ):
            yield _without(f)


def _without(cause: Hypothesis) -> Proposal:
    axis = cause.effect.axis
    return Proposal((axis or 1) - 1, (cause,), or_none="needless", everywhere=axis is None)


def _taken_away(context: Context, cause: Hypothesis) -> float:
    """Return the rise of the mean square without a cause, after one linear step of the others."""
    model, axis = context.state.model, cause.effect.axis
    others = [f for f in model.free if f is not cause]
    without = context.fitter.evaluate(others, model, robot_values=model.robot_values)
    if isinstance(without, Diverged):
        # A loop that swings without end lacks it.
        return float("inf")
    taken = without.total - linear_gain(without) - model.total
    return taken / context.state.counted(None if axis is None else axis - 1)


def doubtful(context: Context) -> Iterator[Proposal]:
    """Propose the set without one cause, for causes that were less likely than *unknown* when they were added.

    Causes that were added beside a withdrawn cause are proposed too. A cause that explains a small part of its axis may
    stay if others explain the rest.
    """
    state = context.state
    steps = [step for step in state.steps if step.move == "withdraw"]
    out = {label for step in steps for label in step.before if label not in step.after}
    for cause, standing in state.accepted:
        beside = {f.effect.label for f in cause.trial.fitted.free}
        if standing.p_unknown > cause.probability or not beside.isdisjoint(out):
            mine = next(f for f in state.model.free if f.effect.label == cause.trial.label)
            yield Proposal(standing.axis, (mine,), or_none="doubtful")
