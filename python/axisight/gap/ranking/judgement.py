"""The judgement of an axis: rules, in order, make the belief in each hypothesis from its held-out loss."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.facts.trace import NONE, UNKNOWN
from axisight.gap.fit.amplitude_significance import amplitude_significance
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.ranking.belief import Belief
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, are_lags
from axisight.gap.ranking.formula_error import held_apart
from axisight.gap.ranking.likelihood import (
    FORMULA_ERROR,
    INDEPENDENT_BLOCKS,
    PARAMETER_COST,
    nats_by_loss,
)
from axisight.gap.ranking.plainer_law import held_to_plainer
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis, in_order
from axisight.gap.ranking.price_of_bending import price_of_bending
from axisight.gap.ranking.price_of_size import price_of_size

Array = NDArray[np.float64]


def stand(
    trials: Sequence[FittedHypothesis],
    current: Array,
    floor: Array,
    layout: Layout,
    axis: int | None,
    *,
    without: FittedModel,
    explained_share: float,
) -> AxisPosterior | None:
    """Rank the candidates that lower the loss of ``axis`` (from 0; None: of all together); None if none does.

    ``current`` and ``floor`` (n_blocks,): held-out loss of the model ``without`` the candidates, and of a perfect
    model. The log-weight of a candidate is the likelihood of its held-out loss with unknown variance, with the formula
    error added, less a cost for each fitted number, less the price of bent own parameters. *None* keeps the loss of
    ``without``. *Unknown* counts as a candidate that explains ``explained_share`` of the loss above the floor.
    """
    here = layout.of(axis)
    before, least = float(current[here].sum()), float(floor[here].sum())
    explainable = max(before - least, 1e-12)
    mine = [t for t in trials if t.held_out[here].sum() < before]
    if not mine:
        return None
    losses = np.array([t.held_out[here].sum() for t in mine])
    hypotheses = np.append(losses, [before, before - explained_share * explainable])
    tempered = np.maximum(hypotheses, least) + FORMULA_ERROR * explainable
    # An unknown cause costs as many numbers as the best known candidate.
    unknown = mine[int(np.argmin(losses))].cost
    cost = np.array([*_costs(mine), 0.0, PARAMETER_COST * unknown])
    belief = Belief([*(t.label for t in mine), NONE, UNKNOWN])
    likelihood = -0.5 * INDEPENDENT_BLOCKS * np.log(tempered)
    belief.becomes("likelihood", likelihood, against=likelihood[-2])
    belief.becomes("cost", likelihood - cost)
    prices = _prices(mine, without, current, floor, layout)
    belief.becomes("own_parameters", belief.log_weight - prices)
    sizes = np.array([*(price_of_size(t.fitted) for t in mine), price_of_size(without), 0.0])
    belief.becomes("size", belief.log_weight - sizes)
    prices += sizes
    fitted = np.array([_fitted_loss(t.fitted, here) for t in mine])
    apart = held_apart(
        [t.hypothesis for t in mine],
        axis,
        belief.log_weight,
        losses,
        explainable,
        least,
        lambda left, which: -0.5 * INDEPENDENT_BLOCKS * np.log(left) - (cost + prices)[which],
    )
    belief.becomes("formula_error", apart)
    explained = (before - losses) / explainable
    better = _with_those_that_fit_better(mine, belief.log_weight, explained, fitted, cost)
    belief.becomes("better_fit", better)
    tried = [t.hypothesis.effect for t in mine]
    plainer = held_to_plainer(tried, [t.fitted for t in mine], belief.log_weight, layout.stretch)
    belief.becomes("plainer_law", plainer)
    probability = belief.probabilities()
    samples = float(layout.counted[here].sum())
    ranked = [
        RankedHypothesis(
            t,
            float((before - loss) / explainable),
            float((before - loss) / samples),
            _significance(t, current, layout, axis, explains=p > probability[-1]),
            float(p),
        )
        for t, loss, p in zip(mine, losses, probability, strict=False)
    ]
    none, unknown = (float(p) for p in probability[-2:])
    return AxisPosterior(axis or 0, in_order(ranked, axis), none, unknown, tuple(belief.ledger))


def _costs(trials: Sequence[FittedHypothesis]) -> Array:
    """Return the cost of the fitted numbers of each trial (n_trials,) [nats].

    An effect that equals another at some values of its parameters costs at most the other's cost plus the log of how
    much rarer it is.
    """
    out = PARAMETER_COST * np.array([t.cost for t in trials])
    places = {(t.hypothesis.effect.name, t.hypothesis.effect.axis): i for i, t in enumerate(trials)}
    for (name, axis), i in places.items():
        like = effect_info(name).resembles
        if like is not None and (like.law, axis) in places:
            out[i] = min(out[i], out[places[like.law, axis]] + float(np.log(like.rarer)))
    return out


def _prices(
    trials: Sequence[FittedHypothesis],
    without: FittedModel,
    current: Array,
    floor: Array,
    layout: Layout,
) -> Array:
    """Return the price of bent own parameters for each trial, *none* and *unknown* (n_trials + 2,) [nats].

    *None* is the model ``without`` the trials. *Unknown* pays nothing.
    """
    least = layout.by_axis(floor)
    explainable = np.maximum(layout.by_axis(current) - least, 0.0)

    def paid(fitted: FittedModel, loss: Array) -> float:
        left = np.maximum(layout.by_axis(loss), least) + FORMULA_ERROR * explainable
        return price_of_bending(fitted, nats_by_loss(left)[layout.axis])

    return np.array([*(paid(t.fitted, t.held_out) for t in trials), paid(without, current), 0.0])


def set_likelier(
    one: FittedHypothesis,
    several: FittedHypothesis,
    without: FittedModel,
    floor: Array,
    layout: Layout,
    axis: int | None,
) -> bool:
    """Whether one effect is likelier than several on ``axis`` (from 0; None: on all together).

    Compares likelihood, cost of numbers, and prices of own parameters and sizes. No formula error is added, since a
    further effect removes more than that. Each effect costs one number more. Losses below ``floor`` (n_blocks,) count
    as the floor.
    """
    here = layout.of(axis)
    both = [one, several]
    left = np.array([max(t.held_out[here].sum(), floor[here].sum()) for t in both])
    cost = PARAMETER_COST * np.array([t.cost + 1 + len(t.also) for t in both])
    price = _prices(both, without, held_out_loss(without), floor, layout)[:2]
    price += [price_of_size(t.fitted) for t in both]
    weight = -0.5 * INDEPENDENT_BLOCKS * np.log(left) - cost - price
    return bool(weight[0] > weight[1])


# Fall of the fit loss that counts as a better fit: a log-likelihood ratio of two, or this share of the loss, at which
# fits of candidates end.
_BETTER = 4.0

_LEFT_OPEN = 2e-3

# Score by which a rival may predict worse than the leader and still count as near.
_NEARLY = 0.1


def _fitted_loss(fitted: FittedModel, here: NDArray[np.bool_]) -> float:
    """Return the loss of a fit on some blocks plus chi-square of the own parameters' tolerances."""
    precision = np.diag(fitted.prior_matrix)
    told = precision > 0
    off = fitted.prior_gradient[told] ** 2 / precision[told]
    return float(fitted.loss[here].sum() + off.sum())


def _with_those_that_fit_better(
    trials: Sequence[FittedHypothesis], logp: Array, score: Array, fitted: Array, cost: Array
) -> Array:
    """Return log-probabilities where a near rival that fits better than the leader is as probable as the leader.

    With few logs, predictions of a left-out log depend on what the other logs tell of the own parameters. If the
    leader predicts better, but a near rival with no more numbers fits better, neither is surer. For lags an equal
    fit is enough. ``score``: share explained by held-out loss; ``fitted``: fit losses on the axis; ``cost`` [nats].
    """
    first = int(np.argmax(logp[: len(trials)]))
    leeway = max(_BETTER, _LEFT_OPEN * fitted[first])
    out = logp.copy()
    for i, t in enumerate(trials):
        if i == first or score[i] <= score[first] - _NEARLY:
            continue
        if are_lags(t, trials[first]):
            if score[i] > score[first] - FORMULA_ERROR and fitted[i] < fitted[first] + leeway:
                out[i] = max(out[i], logp[first] + cost[first] - cost[i])
        elif fitted[i] < fitted[first] - leeway and t.cost <= trials[first].cost:
            out[i] = logp[first]
    return out


def _significance(
    t: FittedHypothesis, current: Array, layout: Layout, axis: int | None, *, explains: bool
) -> float:
    """Return how sure a trial is on an axis, by its gain or by its fitted size [standard deviations].

    The size counts only on an axis where the effect acts, and if it ``explains`` that axis: an effect that explains a
    part has a sure size even where it is not the cause.
    """
    gain = layout.significance(current, t.held_out, axis)
    own = axis is None or t.hypothesis.effect.acts_on(axis + 1)
    return max(gain, amplitude_significance(t.fitted, layout.stretch)) if own and explains else gain
