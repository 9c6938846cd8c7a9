"""Proposes one effect in the place of several causes.

While causes elsewhere are missing, a search may add the wrong law first and a second law that corrects it. Together
they imitate a third one.
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
    """Propose one effect for several causes of one family and axis, or for a load that may be a change of its link."""
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
            # A load shows on every axis that carries it, so it is compared on all.
            everywhere=_is_load(several[0]),
            leeway=0.0 if context.fitter.adds_up or len(several) == 1 else _leeway(several),
            as_entered=len(several) == 1,
        )


def _leeway(several: Sequence[Hypothesis]) -> float:
    """Return the share of the explained loss that one effect may leave more than several.

    The formula error for laws of a gear and for loads, else zero.
    """
    laws = [effect_info(f.effect.name) for f in several]
    if all(law.of_gear for law in laws) or all(law.carried for law in laws):
        return min(law.formula.error for law in laws)
    return 0.0


def _others(
    axis: int, family: str, several: Sequence[Hypothesis], options: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Return the effects that may replace several: of their family, with no more numbers.

    If the several are of different families: only composites that contain the first as a part.
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
    # One of them may suffice from its present values, even if it did not from its start values.
    most = count if _is_load(several[0]) else count - 1
    return [o for o in (*new, *several) if numbers(o) <= most]


def _beside_a_part(model: FittedModel) -> Groups:
    """Return first parts of composites with the one other cause of their axis, by axis and family.

    The search names a composite by its first part if that does as well. The cause that it adds next may stand for the
    second part under another name, such as a balancer for an offset.
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
    """Return the causes of each axis and family that has more than one, without those that are sure by themselves."""
    found: Groups = defaultdict(list)
    for f in model.free:
        if f.effect.axis is not None and not f.sure:
            found[f.effect.axis, effect_info(f.effect.name).family].append(f)
    return {key: several for key, several in found.items() if len(several) > 1}


def _lone_load(model: FittedModel, n_axes: int) -> Groups:
    """Return a single load with the axis of the link that carries it, if no cause changes that link."""
    loads = [f for f in model.free if f.effect.axis is None and _is_load(f)]
    links = [f for f in model.free if f.effect.axis == n_axes and _is_load(f)]
    if len(loads) != 1 or links:
        return {}
    return {(n_axes, effect_info(loads[0].effect.name).family): loads}


def _is_load(free: Hypothesis) -> bool:
    return effect_info(free.effect.name).carried
