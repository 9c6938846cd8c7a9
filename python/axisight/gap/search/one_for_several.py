"""One effect in the place of several: what two laws on an axis imitate together may be a third.

A search that takes in the best of each round may begin with the wrong law, as long as causes
elsewhere are missing, and mend it with another one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info, effect_table
from axisight.fitting.divergence import Diverged
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, numbers, trial
from axisight.gap.ranking.judgement import stand
from axisight.gap.ranking.likelihood import clearly_worse, likelier
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

Array = NDArray[np.float64]


def one_for_several(
    fitter: ModelFitter,
    model: FittedModel,
    options: Sequence[Hypothesis],
    floor: Array,
    layout: Layout,
    settings: Settings,
) -> tuple[RankedHypothesis, AxisPosterior] | None:
    """Return the first effect that does what several of its axis do, of its family or parts of it; None without.

    ``options``: the candidates, which are tried in their place, as is each of the several; ``floor``
    (n_blocks,): loss of noise alone. It has fewer numbers (a load no more), and may leave a little more; of laws
    of a gear and of loads what formulas of one effect differ by. A load alone gives way to one change of the
    last link: at its centre it is no more than that.
    """
    groups = {**several_together(model), **_lone_load(model, layout.n_axes)}
    if not fitter.adds_up:
        groups = {**_beside_a_part(model), **groups}
    for (axis, family), several in groups.items():
        rest = [f for f in model.free if f not in several]
        count = _needed_numbers(several, model)
        others = _others(axis, family, several, options)
        without = fitter.fit(rest, model, lazy=True)
        if isinstance(without, Diverged):
            continue
        trials = [t for o in others if (t := _tried(fitter, rest, o, without)) is not None]
        # A load shows on every axis that carries it, and has to do on all.
        place, judged = axis - 1, layout
        if _is_load(several[0]):
            place, judged = 0, replace(layout, axis=np.zeros_like(layout.axis))
        here = judged.axis == place
        settled_ones = _best_settled(fitter, trials)
        if len(several) == 1 and model.free[-1] is several[0]:
            # What it gives way to may be no likelier than it: it stays a rival.
            settled_ones.append(trial(several[0], model))
        standing = stand(
            settled_ones,
            held_out_loss(without),
            floor,
            judged,
            place,
            without=without,
            explained_share=settings.explained_share,
        )
        if standing is None:
            continue
        # A load is more usual than a link that is not as it was drawn.
        standing = standing.usual_first() if len(several) == 1 else standing
        standing = replace(standing, axis=axis - 1)
        both, none = (float(held_out_loss(x)[here].sum()) for x in (model, without))
        for ranked in standing.ranked:
            if ranked.trial.label == several[0].effect.label and len(several) == 1:
                break
            alone = float(ranked.trial.held_out[here].sum())
            more = _may_leave(several) * (none - both)
            # A lone load needs none of that: no other law has to be imitated.
            mends = not fitter.adds_up and len(several) > 1 and alone - both < more
            mends = mends or (_made_of(ranked, several) and not clearly_worse(alone, both))
            if mends or likelier(alone, ranked.trial.cost, than=(both, count)):
                return standing.best, standing
            # What leaves more than that is none in their place.
            standing = standing.without(ranked.trial.label)
    return None


def _may_leave(several: Sequence[Hypothesis]) -> float:
    """Return the share of what several explain that one in their place may leave more.

    Of laws of a gear what formulas of it differ by, and of loads, which are rigid bodies, what is left of other
    laws; of others nothing.
    """
    laws = [effect_info(f.effect.name) for f in several]
    if all(law.of_gear for law in laws) or all(law.carried for law in laws):
        return min(law.formula.error for law in laws)
    return 0.0


def _made_of(ranked: RankedHypothesis, several: Sequence[Hypothesis]) -> bool:
    """Whether a candidate is made of several effects: one cause, where they are as many as it has parts."""
    parts = effect_info(ranked.trial.hypothesis.effect.name).parts
    return bool(parts) and sorted(parts) == sorted(f.effect.name for f in several)


def _needed_numbers(several: Sequence[Hypothesis], model: FittedModel) -> float:
    """Return how many numbers effects of a model have; of a lone load only those that the logs show."""
    if len(several) == 1 and model.free[-1] is several[0]:
        return trial(several[0], model).cost
    return sum(numbers(f) for f in several)


def _others(
    axis: int, family: str, several: Sequence[Hypothesis], options: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Return what may take the place of several effects: of their family, with no more numbers than they need.

    Of effects of several families only what has the first as a part.
    """
    labels = {f.effect.label for f in several}
    count = sum(numbers(f) for f in several)
    new = [
        o
        for o in options
        if o.effect.axis in (axis, None)
        and effect_info(o.effect.name).family == family
        and o.effect.label not in labels
    ]
    if any(effect_info(f.effect.name).family != family for f in several):
        first = several[0].effect.name
        return [o for o in new if first in effect_info(o.effect.name).parts and numbers(o) <= count]
    # One of them may do it alone from where it is now, and could not from its start.
    most = count if _is_load(several[0]) and len(several) > 1 else count - 1
    return [o for o in (*new, *several) if numbers(o) <= most]


def _beside_a_part(model: FittedModel) -> dict[tuple[int, str], list[Hypothesis]]:
    """Return parts of composites, each with a cause of another family on its axis, by axis and family.

    A search names the first part where the others do as well, and what it finds then may be the second, by
    whatever name: a balancer for an offset.
    """
    composites = [info for info in effect_table().values() if info.parts]
    found: dict[tuple[int, str], list[Hypothesis]] = {}
    for part in model.free:
        axis = part.effect.axis
        others = [f for f in model.free if f.effect.axis == axis and f is not part]
        for info in composites:
            if part.effect.name == info.parts[0] and axis is not None and len(others) == 1:
                found[axis, info.family] = [part, *others]
    return found


def several_together(model: FittedModel) -> dict[tuple[int, str], list[Hypothesis]]:
    """Return the causes of each axis and family that has more than one."""
    found: dict[tuple[int, str], list[Hypothesis]] = defaultdict(list)
    for f in model.free:
        if f.effect.axis is not None:
            found[f.effect.axis, effect_info(f.effect.name).family].append(f)
    return {key: several for key, several in found.items() if len(several) > 1}


def _lone_load(model: FittedModel, n_axes: int) -> dict[tuple[int, str], list[Hypothesis]]:
    """Return a load with the axis of the link that carries it, where that has no other change of the kind."""
    loads = [f for f in model.free if f.effect.axis is None and _is_load(f)]
    links = [f for f in model.free if f.effect.axis == n_axes and _is_load(f)]
    if len(loads) != 1 or links:
        return {}
    return {(n_axes, effect_info(loads[0].effect.name).family): loads}


def _is_load(free: Hypothesis) -> bool:
    return effect_info(free.effect.name).carried


def _best_settled(
    fitter: ModelFitter, trials: Sequence[FittedHypothesis]
) -> list[FittedHypothesis]:
    """Return the trials, the one that leaves least with sensitivities of its own."""
    best = min(trials, key=lambda t: float(t.held_out.sum()), default=None)
    if best is None:
        return []
    fitted = settled(fitter, best.fitted.free, best.fitted)
    if isinstance(fitted, Diverged):
        return list(trials)
    return [trial(t.hypothesis, fitted) if t is best else t for t in trials]


def _tried(
    fitter: ModelFitter, rest: Sequence[Hypothesis], option: Hypothesis, start: FittedModel
) -> FittedHypothesis | None:
    found = fitter.fit([*rest, option], start, lazy=True)
    return None if isinstance(found, Diverged) else trial(option, found)
