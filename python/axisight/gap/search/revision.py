"""Causes judged anew beside those that came in after them: dropped, merged, exchanged, or withdrawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.fitting.divergence import Diverged, must_hold
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss, linear_gain
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.ranking.fitted_hypothesis import trial
from axisight.gap.ranking.judgement import stand
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.one_for_several import one_for_several
from axisight.gap.search.state import OPEN, Round, SearchState
from axisight.gap.search.swap import (
    mending,
    nearly_as_good,
    open_rivals,
    straightened,
    weighed_again,
)

Array = NDArray[np.float64]

# What a law that mends another one leaves at most, of what that one does, where it is the right one.
_MENDED = 0.5


def straighten(fitter: ModelFitter, state: SearchState) -> None:
    """Put a rival in the place of a cause that holds only with a bent simulator."""
    labels = {f.effect.label for f in state.model.free}
    entered = [
        (r, x.standings) for x in state.rounds for r, _ in x.accepted if r.trial.label in labels
    ]
    found = straightened(fitter, state.model, entered)
    if found is not None:
        model, _, rival = found
        state.moved("straighten", model)
        state.rounds.append(Round((rival[1],), (rival,), state.left()))


# Steps of the last fit.
_FINISHING = 12


def finish(fitter: ModelFitter, state: SearchState) -> None:
    """Fit on where a step still promises more than noise leaves open.

    A share of a large loss, at which fits end, may be many standard deviations along a flat valley, such
    as that of a load and the mass of the link that carries it.
    """
    model = state.model
    if not model.free or model.stuck or linear_gain(model) < OPEN:
        return
    found = fitter.fit(
        model.free, model, lazy=True, max_iterations=_FINISHING, refreshes=1, worth=OPEN
    )
    if not isinstance(found, Diverged):
        state.moved("finish", found)


def weigh_again(fitter: ModelFitter, state: SearchState, settings: Settings) -> None:
    """Judge causes anew that were judged beside others than now.

    Those that came in beside what turned out to be none, that another law mends, or that had rivals before
    others came in.
    """
    last, before = state.rounds[-1].standings, state.model
    for cause, standing in state.accepted:
        final = {f.effect.label for f in state.model.free}
        beside = {f.effect.label for f in cause.trial.fitted.free}
        left, axis = state.left(), standing.axis
        if not beside <= final:
            rivals, most = nearly_as_good(state.model, cause, standing), np.inf
        elif mends := mending(cause, last):
            rivals, most = mends, _MENDED * left[axis]
        elif beside < final:
            rivals, most = open_rivals(cause, state.standings_of(cause), final), left[axis]
        else:
            continue
        found = weighed_again(
            fitter,
            state.model,
            cause,
            standing,
            state.floor,
            state.layout,
            settings.explained_share,
            rivals,
        )
        if found is not None and state.left_by(found[0])[axis] < most:
            model, taken = found
            state.moved("exchange", model)
            state.rounds.append(Round((taken[1],), (taken,), left))
    if state.model is not before:
        drop_idle(fitter, state, settings)


def drop_idle(fitter: ModelFitter, state: SearchState, settings: Settings) -> set[str]:
    """Drop the effects that others have made needless; return their labels."""
    dropped: set[str] = set()
    samples = state.layout.samples()
    while len(state.model.free) > 1:
        free = state.model.free
        gains = []
        for i, f in enumerate(free):
            others = [*free[:i], *free[i + 1 :]]
            without = fitter.evaluate(others, state.model, robot_values=state.model.robot_values)
            if isinstance(without, Diverged):
                # A loop that swings without end lacks it.
                gains.append(np.inf)
                continue
            left = without.total - linear_gain(without) - state.model.total
            worth = samples[f.effect.axis - 1] if f.effect.axis else samples.min()
            gains.append(left / float(worth))
        worst = int(np.argmin(gains))
        if gains[worst] > settings.smallest_gain:
            stood_in = _stood_in(fitter, state, settings)
            if stood_in is None:
                break
            label, model = stood_in
            state.moved("stand_in", model)
            dropped.add(label)
            continue
        dropped.add(free[worst].effect.label)
        rest = [*free[:worst], *free[worst + 1 :]]
        state.moved("drop", must_hold(settled(fitter, rest, state.model)))
    return dropped


def _stood_in(
    fitter: ModelFitter, state: SearchState, settings: Settings
) -> tuple[str, FittedModel] | None:
    """Return what stood in for an effect of the whole arm that was found after it, and the fit without.

    A load that came in beside a link with another centre of mass lies elsewhere itself, further than one
    step goes.
    """
    free = state.model.free
    families = {effect_info(f.effect.name).family for f in free if f.effect.place is None}
    for i, f in enumerate(free):
        axis = f.effect.axis
        if axis is None or effect_info(f.effect.name).family not in families:
            continue
        without = settled(fitter, [*free[:i], *free[i + 1 :]], state.model)
        if isinstance(without, Diverged):
            continue
        left = without.total - state.model.total
        if left <= settings.smallest_gain * float(state.layout.samples()[axis - 1]):
            return f.effect.label, without
    return None


def withdraw_doubtful(fitter: ModelFitter, state: SearchState, settings: Settings) -> None:
    """Take out the causes that something unknown is likelier than, and stays so.

    One that explains a small part of its axis is a cause if others explain the rest. Where the rest
    is still there in the end, both are rather parts of something that no effect stands for. What came in
    beside one that is taken out is judged anew.
    """
    now = state.left()
    doubtful = {
        r.trial.label
        for x in state.rounds
        for r, s in x.accepted
        if s.p_unknown > r.probability
        and x.left[s.axis] - now[s.axis] < settings.explained_share * x.left[s.axis]
    }
    while doubtful:
        kept = [f for f in state.model.free if f.effect.label not in doubtful]
        if len(kept) == len(state.model.free):
            break
        state.moved("withdraw", must_hold(settled(fitter, kept, state.model)))
        doubtful |= {
            r.trial.label
            for r, s in state.accepted
            if not doubtful.isdisjoint(f.effect.label for f in r.trial.fitted.free)
            and not _stands(fitter, state, r.trial.label, s.axis, settings)
        }


def _stands(
    fitter: ModelFitter, state: SearchState, label: str, axis: int, settings: Settings
) -> bool:
    """Whether a cause of the model is likelier on an axis than none and something unknown together."""
    mine = next(f for f in state.model.free if f.effect.label == label)
    rest = [f for f in state.model.free if f is not mine]
    without = fitter.fit(rest, state.model, lazy=True)
    fitted = fitter.fit([*rest, mine], state.model, lazy=True)
    if isinstance(without, Diverged) or isinstance(fitted, Diverged):
        # A loop that swings without end lacks it.
        return True
    found = stand(
        [trial(mine, fitted)],
        held_out_loss(without),
        state.floor,
        state.layout,
        axis,
        without=without,
        explained_share=settings.explained_share,
    )
    return found is not None and found.best.probability > found.p_none + found.p_unknown


def merge(
    fitter: ModelFitter, state: SearchState, settings: Settings, options: Sequence[Hypothesis]
) -> set[str]:
    """Put one effect in the place of several that it does as well as; return their labels."""
    gone: set[str] = set()
    while found := one_for_several(
        fitter, state.model, options, state.floor, state.layout, settings
    ):
        fitted = found[0].trial.fitted
        left, now = {f.effect.label for f in state.model.free}, {e.label for e in fitted.effects}
        gone |= left - now
        taken = _as_it_stood(found, left - now, state)
        before = state.left()
        state.moved("merge", must_hold(settled(fitter, fitted.free, fitted)))
        state.rounds.append(Round((taken[1],), (taken,), before))
    return gone


def _as_it_stood(
    found: tuple[RankedHypothesis, AxisPosterior], gone: set[str], state: SearchState
) -> tuple[RankedHypothesis, AxisPosterior]:
    """Return what takes the place of one cause as it stood beside that; there it had all its rivals."""
    for cause, standing in state.accepted if len(gone) == 1 else ():
        if cause.trial.label in gone:
            same = [r for r in standing.inseparable() if r.trial.label == found[0].trial.label]
            return (same[0], standing.led_by(same[0])) if same else found
    return found
