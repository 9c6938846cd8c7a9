"""One effect in the place of several: what two laws on an axis imitate together may be a third.

A search that takes in the best of each round may begin with the wrong law, as long as causes
elsewhere are missing, and mend it with another one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

from axisight.effects import effect_info, effect_table
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import numbers
from axisight.gap.search.contest import Alternative, Context, Proposal

Groups = dict[tuple[int, str], list[Hypothesis]]


def merged(context: Context) -> Iterator[Proposal]:
    """Propose one effect for several of a family on an axis, or for a load that may be one change of its link."""
    model = context.state.model
    groups = {**several_together(model), **_lone_load(model, context.state.layout.n_axes)}
    if not context.fitter.adds_up:
        groups = {**_beside_a_part(model), **groups}
    for (axis, family), several in groups.items():
        others = _others(axis, family, several, context.offered)
        yield Proposal(
            axis - 1,
            tuple(several),
            tuple(Alternative(o) for o in others),
            # A load shows on every axis that carries it, and has to do on all.
            everywhere=_is_load(several[0]),
            leeway=0.0 if context.fitter.adds_up or len(several) == 1 else _leeway(several),
            as_entered=len(several) == 1,
        )


def _leeway(several: Sequence[Hypothesis]) -> float:
    """Return the share of what several explain that one in their place may leave more.

    Of laws of a gear what formulas of it differ by, and of loads, which are rigid bodies, what is left of other
    laws; of others nothing.
    """
    laws = [effect_info(f.effect.name) for f in several]
    if all(law.of_gear for law in laws) or all(law.carried for law in laws):
        return min(law.formula.error for law in laws)
    return 0.0


def _others(
    axis: int, family: str, several: Sequence[Hypothesis], options: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Return what may take the place of several effects: of their family, with no more numbers than they need.

    Of effects of several families only what has the first as a part.
    """
    labels = {f.effect.label for f in several}
    count = sum(map(numbers, several))
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
    if len(several) == 1:
        return [o for o in new if numbers(o) < count]
    # One of them may do it alone from where it is now, and could not from its start.
    most = count if _is_load(several[0]) else count - 1
    return [o for o in (*new, *several) if numbers(o) <= most]


def _beside_a_part(model: FittedModel) -> Groups:
    """Return parts of composites, each with a cause of another family on its axis, by axis and family.

    A search names the first part where the others do as well, and what it finds then may be the second, by
    whatever name: a balancer for an offset.
    """
    composites = [info for info in effect_table().values() if info.parts]
    found: Groups = {}
    for part in model.free:
        axis = part.effect.axis
        others = [f for f in model.free if f.effect.axis == axis and f is not part]
        for info in composites:
            if part.effect.name == info.parts[0] and axis is not None and len(others) == 1:
                found[axis, info.family] = [part, *others]
    return found


def several_together(model: FittedModel) -> Groups:
    """Return the causes of each axis and family that has more than one."""
    found: Groups = defaultdict(list)
    for f in model.free:
        if f.effect.axis is not None:
            found[f.effect.axis, effect_info(f.effect.name).family].append(f)
    return {key: several for key, several in found.items() if len(several) > 1}


def _lone_load(model: FittedModel, n_axes: int) -> Groups:
    """Return a load with the axis of the link that carries it, where that has no other change of the kind."""
    loads = [f for f in model.free if f.effect.axis is None and _is_load(f)]
    links = [f for f in model.free if f.effect.axis == n_axes and _is_load(f)]
    if len(loads) != 1 or links:
        return {}
    return {(n_axes, effect_info(loads[0].effect.name).family): loads}


def _is_load(free: Hypothesis) -> bool:
    return effect_info(free.effect.name).carried
