"""Composites and their parts: names a gap by the parts where they explain as much.

Asymmetric friction is Coulomb friction plus an offset. If one of these, or both, explain as much, the composite is not
the cause.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, trial
from axisight.gap.ranking.likelihood import clearly_worse
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.state import SearchState
from axisight.statistics.tails import normal_deviate

Found = tuple[RankedHypothesis, AxisPosterior]

SHOWS_BESIDE = normal_deviate(0.025)
"""Significance that each of a pair needs beside the other [standard deviations]. The pair as a whole has passed the
test against false alarms of all candidates."""


def named_simply(led: AxisPosterior, fitter: ModelFitter, state: SearchState) -> Sequence[Found]:
    """Return the leading cause, or its parts where they explain as much."""
    if fitter.adds_up:
        whole = _without_rival_composites(led)
        return _in_parts(led, fitter, state.model, state.layout) or ((whole.best, whole),)
    simpler = _simpler(led, fitter)
    return ((simpler.best, simpler),)


def _first_part(standing: AxisPosterior) -> RankedHypothesis | None:
    """Return the rival that is the first part of a winner which simpler effects imitate."""
    effect = standing.best.trial.hypothesis.effect
    parts = effect_info(effect.name).parts
    if not parts:
        return None
    label = Effect(parts[0], effect.axis).label
    return next((r for r in standing.ranked if r.trial.label == label), None)


def _simpler(standing: AxisPosterior, fitter: ModelFitter) -> AxisPosterior:
    """Return a standing led by the first part of a composite winner, where parts do nearly as well or better.

    Where the first does nearly as well alone, the composite stays a rival. Where it takes both parts, one cause is
    likelier than two: it has to leave clearly more than they do.
    """
    part = _first_part(standing)
    if part is None:
        return standing
    if any(r is part for r in standing.inseparable()):
        return standing.led_by(part, "simplest_first")
    winner = standing.best
    effect = winner.trial.hypothesis.effect
    second = effect_info(effect.name).parts[1]
    other = Hypothesis(Effect(second, effect.axis), (effect_info(second).parameters[0].name,))
    both = fitter.fit([*part.trial.fitted.free, other], part.trial.fitted, lazy=True)
    if isinstance(both, Diverged):
        return standing
    if clearly_worse(float(winner.trial.held_out.sum()), float(held_out_loss(both).sum())):
        return standing.joined(part, [part, standing.best])
    return standing


def _without_rival_composites(standing: AxisPosterior) -> AxisPosterior:
    """Return the posterior with composites that contain the leader joined into the leader.

    A later round asks whether their other part is there too.
    """
    winner = standing.best.trial.hypothesis.effect
    composed = [
        r
        for r in standing.ranked[1:]
        if winner.name in effect_info(r.trial.hypothesis.effect.name).parts
        and r.trial.hypothesis.effect.axis == winner.axis
    ]
    return standing.joined(standing.best, [standing.best, *composed]) if composed else standing


def _in_parts(
    standing: AxisPosterior, fitter: ModelFitter, model: FittedModel, layout: Layout
) -> tuple[Found, ...]:
    """Return the parts of a leading composite if they explain as much; else none.

    Only parts that are significant beside the other: asymmetric friction may be Coulomb friction, an offset, or both.
    """
    winner = standing.best
    effect = winner.trial.hypothesis.effect
    parts = effect_info(effect.name).parts
    if not parts:
        return ()
    present = {e.label for e in model.effects}
    free = parts_of(effect, winner.trial.hypothesis, present)
    alone = all_fitted(fitted_with(fitter, [*model.free, f], model) for f in free)
    both = alone
    if alone is not None and len(free) == 2:
        both = all_fitted(
            fitted_with(fitter, [*model.free, g, f], beside.fitted, lazy=True)
            for f, g, beside in zip(free, free[::-1], alone[::-1], strict=True)
        )
    if not alone or not both:
        return ()
    if clearly_worse(float(both[0].held_out.sum()), float(winner.trial.held_out.sum())):
        return ()
    chosen = _needed(alone, both, layout, standing.axis)
    labels = {t.label for t in both} | {winner.trial.label}
    same = [r for r in standing.ranked if r.trial.label in labels]
    joined = [standing.joined(replace(winner, trial=t), same) for t in chosen]
    return tuple((led.best, led) for led in joined)


def _needed(
    alone: Sequence[FittedHypothesis], both: Sequence[FittedHypothesis], layout: Layout, axis: int
) -> Sequence[FittedHypothesis]:
    """Return the trials of the parts that are significant beside the other; the first if none is."""
    if len(both) < 2:
        return both
    sure = [
        layout.significance(beside.held_out, t.held_out, axis) > SHOWS_BESIDE
        for beside, t in zip(alone[::-1], both, strict=True)
    ]
    if all(sure):
        return both
    return [alone[1]] if sure[1] else [alone[0]]


def parts_of(composite: Effect, tried: Hypothesis, known: Collection[str]) -> list[Hypothesis]:
    """Return the parts of a composite that are not ``known`` by label, with the composite's shape parameters.

    Shape parameters are free where those of the composite are, as it was ``tried``.
    """
    free = [_part(name, composite, tried) for name in effect_info(composite.name).parts]
    return [f for f in free if f.effect.label not in known]


def fitted_with(
    fitter: ModelFitter, free: Sequence[Hypothesis], start: FittedModel, *, lazy: bool = False
) -> FittedHypothesis | None:
    """Return the last of the effects ``free`` fitted beside the others; None if it diverges."""
    found = fitter.fit(free, start, lazy=lazy)
    return None if isinstance(found, Diverged) else trial(free[-1], found)


def all_fitted(trials: Iterable[FittedHypothesis | None]) -> list[FittedHypothesis] | None:
    """Return the trials; None if one of them diverged."""
    found = []
    for one in trials:
        if one is None:
            return None
        found.append(one)
    return found


def _part(name: str, composite: Effect, tried: Hypothesis) -> Hypothesis:
    """Return a part of a composite, with the composite's shape parameters."""
    given = composite.parameters or {}
    info = effect_info(name).parameters
    values = {p.name: given.get(p.name, p.neutral) for p in info}
    shared = {p.name: tried.bounds[p.name] for p in info if p.name in tried.bounds}
    free = tuple(p.name for p in info if p.role == "amplitude" or p.name in tried.free)
    return Hypothesis(Effect(name, composite.axis, values), free, bounds=shared)
