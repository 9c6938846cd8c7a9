"""A cause gives way to a rival: to one that bends the simulator less, or is likelier beside what came in since.

Two effects may explain as much of an axis within what formulas differ by, and the simpler one leads: a
heavier link for a load beside it. What it leaves is small against what it explains, not against
noise, and the simulator's own parameters are bent to it as far as they go.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.fitting.divergence import Diverged, must_hold
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.fit.tolerance_edges import BENT, bent
from axisight.gap.ranking.fitted_hypothesis import trial
from axisight.gap.ranking.judgement import stand
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening.screening import kept_beside

Array = NDArray[np.float64]
Found = tuple[RankedHypothesis, AxisPosterior]

# Rivals that are tried, and what they explain of what the cause does.
_RIVALS = 3
_AS_MUCH = 0.95
# What a rival leaves at most, of what the cause does, where few parameters are at the edge.
_CLEARLY = 0.98
# The same where a cause was judged beside one that is none.
_AGAIN = 2
_NEARLY = 0.8


def straightened(
    fitter: ModelFitter,
    model: FittedModel,
    entered: Sequence[tuple[RankedHypothesis, Sequence[AxisPosterior]]],
) -> tuple[FittedModel, RankedHypothesis, Found] | None:
    """Return a model with a rival in the place of one of its causes, that cause, and the rival.

    ``entered``: the causes, each with the standings of the round it came in. None where no rival
    leaves less with a simulator that is not bent. Of one that is hardly bent, only what could not be told
    from the cause as it entered, and leaves clearly less with fewer parameters at the edge.
    """
    how = bent(fitter, model)
    hardly = how < BENT
    most, share = (how, _CLEARLY) if hardly else (BENT, 1.0)
    best: tuple[FittedModel, RankedHypothesis, Found] | None = None
    for cause, standings in entered if how > 0 else ():
        known = {r.trial.label for r in open_rivals(cause, standings, ())}
        for rival in _rivals(cause, standings):
            if hardly and rival[0].trial.label not in known:
                continue
            other = in_its_place(fitter, model, cause, rival[0])
            least = share * model.total if best is None else best[0].total
            if other is not None and other.total < least and bent(fitter, other) < most:
                best = other, cause, _beside(cause, rival[0], standings) if hardly else rival
    return best


def _beside(
    cause: RankedHypothesis, rival: RankedHypothesis, standings: Sequence[AxisPosterior]
) -> Found:
    """Return a rival before the cause that it takes the place of, which stays its own rival.

    Neither was clear as the cause entered, and neither is now: each has the other's probability.
    """
    label, its = cause.trial.label, rival.trial.label
    led = (s for s in standings if s.best.trial.label == label)
    entered = next(s for s in led if any(r.trial.label == its for r in s.inseparable()))
    second = next(r for r in entered.ranked if r.trial.label == its)
    changed = entered.exchanged("straighter_first", second)
    behind = sorted(changed.ranked[1:], key=lambda r: -r.probability)
    changed = replace(changed, ranked=(changed.best, *behind))
    return changed.best, changed


def nearly_as_good(
    model: FittedModel, cause: RankedHypothesis, entered: AxisPosterior
) -> list[RankedHypothesis]:
    """Return what explained nearly as much as a cause of its axis, as it entered.

    A cause is judged beside what was in the model then: where that turned out to be none, anew.
    """
    others = {f.effect.label for f in model.free} - {cause.trial.label}
    return [
        r
        for r in entered.ranked
        if r is not cause
        and r.score >= _NEARLY * cause.score
        and r.trial.hypothesis.effect.axis == cause.trial.hypothesis.effect.axis
        and r.trial.label not in others
    ][:_AGAIN]


def open_rivals(
    cause: RankedHypothesis, entered: Sequence[AxisPosterior], final: Collection[str]
) -> list[RankedHypothesis]:
    """Return what could not be told from a cause as it entered, and is not in the model itself.

    What was explained since hid which of them it is. ``entered``: how its round stood.
    """
    label = cause.trial.label
    led = [s for s in entered if s.best.trial.label == label]
    stood = sorted((r for s in led for r in s.inseparable()), key=lambda r: -r.probability)
    likeliest = {r.trial.label: r for r in reversed(stood)}
    others = [r for r in stood if r is likeliest[r.trial.label]]
    return [r for r in others if r.trial.label not in {label, *final}][:_RIVALS]


def alike(one: Effect, other: Effect) -> bool:
    """Whether two effects are laws of one gear, or of one dry friction."""
    law = effect_info(one.name).law_of
    return law is not None and law == effect_info(other.name).law_of


def mending(cause: RankedHypothesis, standings: Sequence[AxisPosterior]) -> list[RankedHypothesis]:
    """Return the laws of the gear or the dry friction of a cause that lead its axis beside it.

    Such a law is no second cause. It may be the right one, whose first fit had not come far.
    """
    first = cause.trial.hypothesis.effect
    laws = [(s.best, s.best.trial.hypothesis.effect) for s in standings if s.axis + 1 == first.axis]
    return [
        r
        for r, law in laws
        if law.axis == first.axis and law.label != first.label and alike(law, first)
    ]


def weighed_again(
    fitter: ModelFitter,
    model: FittedModel,
    cause: RankedHypothesis,
    entered: AxisPosterior,
    floor: Array,
    layout: Layout,
    explained_share: float,
    rivals: Sequence[RankedHypothesis],
) -> tuple[FittedModel, Found] | None:
    """Return a model with one of ``rivals`` in the place of a cause, where beside the others it is likelier."""
    free, label = model.free, cause.trial.label
    rest = [f for f in free if f.effect.label != label]
    if not rivals:
        return None
    mine = next(f for f in free if f.effect.label == label)
    # A trial is of the last effect of its model.
    fits = {label: must_hold(fitter.fit([*rest, mine], model, lazy=True))}
    for r in rivals:
        other = in_its_place(fitter, model, cause, r)
        if other is not None and len(other.free) == len(free):
            fits[r.trial.label] = other
    without = must_hold(fitter.fit(rest, model, lazy=True))
    tried = [trial(fit.free[-1], fit) for fit in fits.values()]
    standing = stand(
        tried,
        held_out_loss(without),
        floor,
        layout,
        entered.axis,
        without=without,
        explained_share=explained_share,
    )
    found = None if standing is None else standing.usual_first().play_first()
    if found is None or found.best.trial.label == label:
        return None
    return fits[found.best.trial.label], (found.best, found)


def _rivals(cause: RankedHypothesis, standings: Sequence[AxisPosterior]) -> list[Found]:
    """Return those that explain as much, each as it stands best without the cause.

    Those whose fits left least come first.
    """
    found: dict[str, Found] = {}
    label = cause.trial.label
    for standing in standings:
        score = next((r.score for r in standing.ranked if r.trial.label == label), None)
        if score is None:
            continue
        alone = standing.without(label)
        for r in alone.ranked:
            known = found.get(r.trial.label)
            if r.score >= _AS_MUCH * score and (
                known is None or r.probability > known[0].probability
            ):
                found[r.trial.label] = r, alone.led_by(r)
    ranked = sorted(found.values(), key=lambda x: (x[0].trial.fitted.total, x[0].trial.label))
    return ranked[:_RIVALS]


def in_its_place(
    fitter: ModelFitter, model: FittedModel, cause: RankedHypothesis, rival: RankedHypothesis
) -> FittedModel | None:
    """Return a model with a rival in the place of one of its causes; None where it cannot be simulated."""
    new = rival.trial.fitted.free[-1]
    others = [f for f in model.free if f.effect.label != cause.trial.label]
    free = [*kept_beside(others, new), new]
    alone = len(free) == len(rival.trial.fitted.free)
    start = rival.trial.fitted if alone else model
    found = fitter.fit(free, start, refreshes=1)
    if not isinstance(found, Diverged):
        found = settled(fitter, found.free, found)
    return None if isinstance(found, Diverged) else found
