"""Proposes to replace or remove causes whose size is not sure: the interval of every amplitude includes nothing.

Sizes are judged when all causes are in the model. Before, the errors of missing causes widen every interval.
"""

from __future__ import annotations

from collections.abc import Iterator

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.ranking.intervals import of_sure_size
from axisight.gap.search.contest import Alternative, Context, Proposal
from axisight.gap.search.rivals import RIVALS


def size_is_sure(model: FittedModel, place: int) -> bool:
    """Whether the size of an effect of a model differs from what the simulator has; ``place`` counts from 0."""
    one = model.free[place]
    if one.sure:
        return True
    std = {name: s for (at, name), s in model.std.items() if at == place}
    return of_sure_size(model.effects[place], one.free, std, one.stated)


def unsure(context: Context) -> Iterator[Proposal]:
    """Propose the rivals of each cause whose size is not sure; without rivals it stays where it is likelier than none.

    Such a cause explains the logs by several numbers that make up for one another. A law with fewer numbers, whose size
    is sure, may explain them as well.
    """
    model = context.state.model
    labels = {f.effect.label for f in model.free}
    for place, (cause, standing) in enumerate(context.state.accepted):
        if not size_is_sure(model, place):
            instead = tuple(
                Alternative(r.trial.fitted.free[-1], model)
                for r in standing.ranked
                if r.trial.label not in labels
                and size_is_sure(r.trial.fitted, len(r.trial.fitted.free) - 1)
            )[:RIVALS]
            mine = next(f for f in model.free if f.effect.label == cause.trial.label)
            yield Proposal(standing.axis, (mine,), instead, "doubtful", never_stays=True)
