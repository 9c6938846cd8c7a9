"""The hypotheses that a verdict leaves open, each as a fitted model with its weight."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from axisight.fitting.divergence import Diverged
from axisight.gap.facts.result import Cause
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.posterior import RankedHypothesis
from axisight.gap.search.state import SearchState
from axisight.posterior.settings import LEAST_ODDS, MOST_RIVALS


@dataclass(frozen=True)
class WeighedModel:
    """A fitted model with its weight relative to the leading one [1]."""

    model: FittedModel
    weight: float


def weighed_models(
    found: SearchState, causes: Sequence[Cause], fitter: ModelFitter
) -> tuple[list[WeighedModel], dict[str, str]]:
    """Return the leading model and those with rivals in place of causes; and, by label, why other rivals have none.

    Each rival that the data cannot tell from a cause takes its place in turn. Its weight relative to the cause is the
    ratio of their probabilities in the comparison. Rivals of several causes combine as if independent. ``fitter``:
    that of `own_fitter`.
    """
    models, without = [WeighedModel(found.model, 1.0)], dict[str, str]()
    groups = [_group(found, cause, without) for cause in causes]
    groups = [group for group in groups if group]
    for picked in _combinations(groups):
        odds, exchanged = 1.0, list(found.model.free)
        for label, rival in picked:
            place = next(i for i, f in enumerate(exchanged) if f.effect.label == label)
            exchanged[place] = _fitted_hypothesis(rival)
            odds *= _odds(found, label, rival)
        fitted = fitter.fit(exchanged, found.model, fresh=True)
        if isinstance(fitted, Diverged) or not (fitted.converged or fitted.stuck):
            without |= {
                r.trial.label: "its fit beside the other causes did not converge" for _, r in picked
            }
        else:
            models.append(WeighedModel(fitted, odds))
    return models, without


def _group(
    found: SearchState, cause: Cause, without: dict[str, str]
) -> list[tuple[str, RankedHypothesis]]:
    """Return the rivals of a cause that were fitted; record why the others have no values."""
    standing = next((s for r, s in found.accepted if r.trial.label == cause.label), None)
    ranked = [] if standing is None else standing.ranked
    out = []
    for label in cause.rivals:
        rival = next((r for r in ranked if r.trial.label == label), None)
        if rival is None:
            without[label] = f"no log tells it from {cause.label}, so it has no values of its own"
        elif rival.trial.also:
            without[label] = "it is a set of several effects"
        else:
            out.append((cause.label, rival))
    return out


def _combinations(
    groups: Sequence[Sequence[tuple[str, RankedHypothesis]]],
) -> list[list[tuple[str, RankedHypothesis]]]:
    """Return the likeliest choices of at least one rival, each with the cause that it replaces."""
    options = [[None, *group] for group in groups]
    every = [[one for one in pick if one is not None] for pick in itertools.product(*options)]
    return sorted((pick for pick in every if pick), key=len)[:MOST_RIVALS]


def _odds(found: SearchState, label: str, rival: RankedHypothesis) -> float:
    winner = next(r for r, _ in found.accepted if r.trial.label == label)
    return max(rival.probability / max(winner.probability, 1e-300), LEAST_ODDS)


def _fitted_hypothesis(rival: RankedHypothesis) -> Hypothesis:
    label = rival.trial.hypothesis.effect.label
    return next(f for f in rival.trial.fitted.free if f.effect.label == label)
