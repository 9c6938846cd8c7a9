"""Proposes to replace or remove causes whose size is not sure: the interval of every amplitude includes nothing.

Sizes are judged when all causes are in the model. Before, the errors of missing causes widen every interval.
"""

from __future__ import annotations

from collections.abc import Iterator

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.ranking.intervals import sureness
from axisight.gap.search.contest import Alternative, Context, Proposal
from axisight.gap.search.rivals import RIVALS


def unsure(context: Context) -> Iterator[Proposal]:
    """Propose the rivals of each cause whose size is not sure; it goes out even if none of them explains the axis.

    Such a cause explains the logs by several numbers that make up for one another. A law with fewer numbers, whose size
    is sure, may explain them as well. The least sure comes first: without it, others may become sure.
    """
    model = context.state.model
    labels = {f.effect.label for f in model.free}
    sure = [_sureness(model, place) for place in range(len(model.free))]
    for place, (cause, standing) in sorted(
        enumerate(context.state.accepted), key=lambda found: sure[found[0]]
    ):
        if sure[place] > 1:
            return
        instead = tuple(
            Alternative(r.trial.fitted.free[-1], model)
            for r in standing.ranked
            if r.trial.label not in labels and _sureness(r.trial.fitted, -1) > 1
        )[:RIVALS]
        mine = next(f for f in model.free if f.effect.label == cause.trial.label)
        yield Proposal(standing.axis, (mine,), instead, never_stays=True)


def _sureness(model: FittedModel, place: int) -> float:
    """Return the sureness of an effect of a model; ``place`` counts from 0, or from the end if negative."""
    place %= len(model.free)
    std = {name: s for (at, name), s in model.std.items() if at == place}
    return sureness(model.effects[place], model.free[place], std)
