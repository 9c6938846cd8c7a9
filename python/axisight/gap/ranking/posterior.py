"""From held-out losses to ranks, probabilities and what cannot be told apart, axis by axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.facts.trace import NONE, UNKNOWN, Adjustment, log_odds
from axisight.gap.fit.amplitude_significance import amplitude_significance
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.idle_numbers import idle_numbers
from axisight.gap.ranking.belief import Belief
from axisight.gap.ranking.formula_error import NEXT_TO_NOTHING, held_apart
from axisight.gap.ranking.plainer_law import held_to_plainer

Array = NDArray[np.float64]

# Residuals of neighbouring blocks and logs share their causes; this many blocks count as
# independent in a likelihood ratio.
_INDEPENDENT_BLOCKS = 60.0
FORMULA_ERROR = 0.02
"""Share of the explained error by which two formulas for one physical effect may differ (tanh or algebraic
Coulomb, play or dead zone): differences in fit below it say nothing about the cause."""
# Log-probability each fitted number costs (Schwarz 1978, with the blocks above).
_PARAMETER_COST = 0.5 * float(np.log(_INDEPENDENT_BLOCKS))


TINY = 1e-300
"""Smallest weight that is divided by."""


def _against_the_best(standing: AxisPosterior) -> dict[str, float]:
    """Return how probable each candidate of an axis is against the best there, by label."""
    return {r.trial.label: r.probability / standing.best.probability for r in standing.ranked}


def numbers(effect: Hypothesis) -> float:
    """Return the number of fitted values of an effect; the order of a harmonic counts too.

    On which side of a gear it acts is a place, which counts no more than the axis does.
    """
    harmonics = sum(name.startswith("cosine_") and name[7].isdigit() for name in effect.free)
    places = effect_info(effect.effect.name).marked("place")
    return float(len(effect.free) + harmonics - len({*places} & {*effect.free}))


@dataclass(frozen=True)
class FittedHypothesis:
    """A candidate fitted on top of a model: its held-out loss by block, (n_blocks,).

    ``idle``: numbers of it that it does not need.
    """

    hypothesis: Hypothesis
    fitted: FittedModel
    held_out: Array
    idle: float = 0.0

    @property
    def label(self) -> str:
        """``effect@axis``."""
        return self.hypothesis.effect.label

    @property
    def cost(self) -> float:
        """Number of fitted values that it needs; the order of a harmonic counts too."""
        return numbers(self.hypothesis) - self.idle


@dataclass(frozen=True)
class RankedHypothesis:
    """A trial as it stands on one axis.

    ``score``: share of what is left to explain there that it removes; ``gain``: fall of the mean
    square of the weighted residual there; ``significance``: how sure that is, in standard
    deviations; ``probability`` among all candidates there, no cause and an unknown one.
    """

    trial: FittedHypothesis
    score: float
    gain: float
    significance: float
    probability: float

    @property
    def family(self) -> str:
        """What kind of cause it is."""
        return effect_info(self.trial.hypothesis.effect.name).family


@dataclass(frozen=True)
class AxisPosterior:
    """How the candidates stand on one axis (from 0), best first; with the two that are none.

    ``ledger``: the entries that made their log-weights, in order. A probability changes only by `adjusted`,
    `exchanged` and `joined`, and each writes there what it did.
    """

    axis: int
    ranked: tuple[RankedHypothesis, ...]
    p_none: float
    p_unknown: float
    ledger: tuple[Adjustment, ...] = ()

    @property
    def best(self) -> RankedHypothesis:
        """The most probable candidate."""
        return self.ranked[0]

    def adjusted(self, rule: str, odds: Mapping[str, float]) -> AxisPosterior:
        """Return the same with candidates, by label, counted for so many times as probable; without those of zero."""
        weighed = [(odds.get(r.trial.label, 1.0), r) for r in self.ranked]
        left = [(times * r.probability, r) for times, r in weighed if times > 0]
        if any(times != 1 for times, _ in weighed if times > 0):
            left.sort(key=lambda pair: -pair[0])
        whole = sum(weight for weight, _ in left) + self.p_none + self.p_unknown
        entries = (Adjustment(rule, r.trial.label, log_odds(x)) for x, r in weighed if x != 1)
        return AxisPosterior(
            self.axis,
            tuple(replace(r, probability=weight / whole) for weight, r in left),
            self.p_none / whole,
            self.p_unknown / whole,
            (*self.ledger, *entries),
        )

    def exchanged(self, rule: str, one: RankedHypothesis) -> AxisPosterior:
        """Return the same led by another candidate, the probabilities of both exchanged."""
        first = replace(one, probability=self.best.probability)
        other = replace(self.best, probability=one.probability)
        nats = log_odds(first.probability) - log_odds(max(one.probability, TINY))
        entries = (
            Adjustment(rule, first.trial.label, nats),
            Adjustment(rule, other.trial.label, -nats),
        )
        rest = tuple(other if r is one else r for r in self.ranked[1:])
        return replace(self, ranked=(first, *rest), ledger=(*self.ledger, *entries))

    def joined(self, into: RankedHypothesis, parts: Sequence[RankedHypothesis]) -> AxisPosterior:
        """Return the same led by ``into``, in the place of ``parts`` and with their probability."""
        gone = {r.trial.label for r in parts}
        first = replace(into, probability=sum(r.probability for r in parts))
        rest = (r for r in self.ranked if r.trial.label not in gone)
        more = first.probability / into.probability if into.probability > 0 else 1.0
        entries = [Adjustment("composite", first.trial.label, log_odds(more))]
        entries += [
            Adjustment("composite", r.trial.label, log_odds(0.0))
            for r in parts
            if r.trial.label != first.trial.label
        ]
        return replace(self, ranked=(first, *rest), ledger=(*self.ledger, *entries))

    def led_by(self, first: RankedHypothesis, rule: str | None = None) -> AxisPosterior:
        """Return the same with one of its candidates named first, as probable as it is."""
        entry = () if rule is None else (Adjustment(rule, first.trial.label, 0.0),)
        rest = (r for r in self.ranked if r is not first)
        return replace(self, ranked=(first, *rest), ledger=(*self.ledger, *entry))

    def without_first(self, count: int) -> AxisPosterior:
        """Return the same without its first candidates."""
        return self.without(*(r.trial.label for r in self.ranked[:count]))

    def without(self, *labels: str) -> AxisPosterior:
        """Return the same without some candidates, by label."""
        return self.adjusted("not_a_cause", dict.fromkeys(labels, 0.0))

    def with_axes_it_leads(self, others: Sequence[AxisPosterior]) -> AxisPosterior:
        """Return the same with rivals held against the first where they do worst.

        ``others``: of other axes that the first leads too. What moves several axes is seen on
        all of them; one that does as well on one of them may do worse on another.
        """
        first = self.best.probability
        there = [_against_the_best(other) for other in others]
        odds = {
            r.trial.label: min(
                (first * x.get(r.trial.label, 0.0) / max(r.probability, TINY) for x in there),
                default=1.0,
            )
            for r in self.ranked
        }
        return self.adjusted("other_axes", {label: min(x, 1.0) for label, x in odds.items()})

    def with_axes_rivals_lead(self, others: Sequence[AxisPosterior]) -> AxisPosterior:
        """Return the same with all held by what axes say on which rivals of the first lead surely.

        ``others``: of these axes. What is seen on two axes is judged by both.
        """
        there = [_against_the_best(other) for other in others]
        odds = {
            r.trial.label: prod(min(x.get(r.trial.label, 0.0), 1.0) for x in there)
            for r in self.ranked
        }
        return self.adjusted("rival_leads", odds)

    def inseparable(self) -> list[RankedHypothesis]:
        """Return the candidates the data cannot tell apart, the winner first; one if it is clear.

        Of many rivals none of which is likely by itself, the likeliest.
        """
        winner, rivals = self.best, self.ranked[1:]
        bar = _RIVAL * winner.probability / (1 - _RIVAL)
        together = sum(r.probability for r in rivals)
        if together > _RIVALS * winner.probability / (1 - _RIVALS):
            bar = min(bar, rivals[0].probability)
        return [winner, *(r for r in rivals if r.probability >= bar)]

    def usual_first(self) -> AxisPosterior:
        """Return the same with what is more usual than the winner counted for as much more.

        What both explain as well is more often the usual one.
        """
        effect = self.best.trial.hypothesis.effect
        usual = [effect_info(name) for name in effect_info(effect.name).usual]
        axes = [effect.axis] if effect.axes is None else list(effect.axes)
        odds = {
            Effect(i.name, None if i.scope == "arm" else axis).label: i.usual_odds
            for i in usual
            for axis in axes
        }
        return self.adjusted("look_alike", odds)

    def play_first(self) -> AxisPosterior:
        """Return the same led by play where the winner is a gear whose middle has lost its stiffness.

        Such a gear has play, whichever formula does better: engines and machines end it more softly or harder.
        """
        effect = self.best.trial.fitted.effects[-1]
        info = effect_info(effect.name)
        named = dict(zip((p.name for p in info.parameters), effect.values(), strict=True))
        if info.spring is None or abs(named[info.spring.sums[0][0]]) < _NO_MIDDLE:
            return self
        label = Effect(info.spring.without_middle, effect.axis).label
        for play in self.ranked[1:]:
            if play.trial.label == label and play.score >= _AS_PLAY * self.best.score:
                return self.exchanged("play_of_gear", play)
        return self


# A middle that has lost this share of its stiffness is none; and what play explains of what it does.
_NO_MIDDLE = 0.95
_AS_PLAY = 0.8
# A rival this likely beside the winner leaves the cause open, and so do all of them if together they are
# as likely as this.
_RIVAL = 0.2
_RIVALS = 0.25


def trial(
    hypothesis: Hypothesis, fitted: FittedModel, model: FittedModel | None = None
) -> FittedHypothesis:
    """Score a fitted candidate on held-out data.

    ``model``: without it, on top of which it is judged. Where parts of the data are left out otherwise than
    of that alone, what it lowers the loss by is counted with these.
    """

    def pays(loss: float, without: float, count: float) -> bool:
        return likelier(loss, count, than=(without, 0.0))

    held_out = held_out_loss(fitted)
    if model is not None:
        held_out = held_out + _left_out_otherwise(model, fitted)
    return FittedHypothesis(hypothesis, fitted, held_out, idle_numbers(fitted, pays))


def _left_out_otherwise(model: FittedModel, fitted: FittedModel) -> Array:
    """Return what parameters of the simulator add to the loss of each block where logs are left out as of ``model``.

    Beyond what they do as of ``evidence``. Where they add less on an axis, it is the gap that misleads them, and
    that a fit with its cause no longer has.
    """
    more = held_out_loss(model) - held_out_loss(model, like=fitted)
    on_axis = np.bincount(model.axis, more)[model.axis]
    return np.asarray(np.where(on_axis > 0, more, 0.0))


def falls(trials: Sequence[FittedHypothesis], current: Array, layout: Layout) -> Array:
    """Return by how much each trial lowers the held-out loss of each axis, (n_trials, n_axes)."""
    return np.array([layout.by_axis(current - t.held_out) for t in trials]).reshape(
        len(trials), layout.n_axes
    )


def stand(
    trials: Sequence[FittedHypothesis],
    current: Array,
    floor: Array,
    layout: Layout,
    axis: int,
    *,
    explained_share: float,
) -> AxisPosterior | None:
    """Rank the candidates that lower the loss of ``axis`` (from 0); None if there is none.

    ``current`` and ``floor`` (n_blocks,): held-out loss without the candidates and of a perfect
    model. Likelihood ratio of the held-out error on the axis with unknown variance, formula error
    added, one cost per fitted number. *No cause* leaves the loss what it is. *Something unknown*
    counts as a candidate that explains ``explained_share``: one that explains less is less
    probable than a cause nobody has thought of.
    """
    here = layout.axis == axis
    before, least = float(current[here].sum()), float(floor[here].sum())
    explainable = max(before - least, 1e-12)
    mine = [t for t in trials if t.held_out[here].sum() < before]
    if not mine:
        return None
    losses = np.array([t.held_out[here].sum() for t in mine])
    hypotheses = np.append(losses, [before, before - explained_share * explainable])
    tempered = np.maximum(hypotheses, least) + FORMULA_ERROR * explainable
    # An unknown cause has as many numbers to it as the known one that explains most.
    unknown = mine[int(np.argmin(losses))].cost
    cost = np.array([*_costs(mine), 0.0, _PARAMETER_COST * unknown])
    belief = Belief([*(t.label for t in mine), NONE, UNKNOWN])
    likelihood = -0.5 * _INDEPENDENT_BLOCKS * np.log(tempered)
    belief.becomes("likelihood", likelihood, against=likelihood[-2])
    belief.becomes("cost", likelihood - cost)
    fitted = np.array([_fitted_loss(t.fitted, here) for t in mine])
    apart = held_apart(
        [t.hypothesis for t in mine],
        axis,
        belief.log_weight,
        losses,
        explainable,
        least,
        lambda left, which: -0.5 * _INDEPENDENT_BLOCKS * np.log(left) - cost[which],
    )
    belief.becomes("formula_error", apart)
    explained = (before - losses) / explainable
    better = _with_those_that_fit_better(mine, belief.log_weight, explained, fitted, cost)
    belief.becomes("better_fit", better)
    tried = [t.hypothesis.effect for t in mine]
    plainer = held_to_plainer(tried, [t.fitted for t in mine], belief.log_weight, layout.stretch)
    belief.becomes("plainer_law", plainer)
    probability = belief.probabilities()
    samples = float(layout.samples()[axis])
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
    ranked.sort(key=lambda r: (-r.probability, -r.score, r.trial.label))
    none, unknown = (float(p) for p in probability[-2:])
    return AxisPosterior(axis, tuple(ranked), none, unknown, tuple(belief.ledger))


def _costs(trials: Sequence[FittedHypothesis]) -> Array:
    """Return what the numbers of each trial cost (n_trials,).

    What is like another effect at some values of its parameters is no rarer, where neither leaves more, than its
    resemblance has it: its further numbers cost no more than that.
    """
    out = _PARAMETER_COST * np.array([t.cost for t in trials])
    places = {(t.hypothesis.effect.name, t.hypothesis.effect.axis): i for i, t in enumerate(trials)}
    for (name, axis), i in places.items():
        like = effect_info(name).resembles
        if like is not None and (like.law, axis) in places:
            out[i] = min(out[i], out[places[like.law, axis]] + float(np.log(like.rarer)))
    return out


# Half of it is a log-likelihood ratio; and fits of candidates end at a share of their loss, of which
# they leave open about as much again.
_BETTER = 4.0
_LEFT_OPEN = 2e-3
# Share of what there is to explain by which it may predict worse all the same.
_NEARLY = 0.1


def _fitted_loss(fitted: FittedModel, here: NDArray[np.bool_]) -> float:
    """Return the loss of a fit on some blocks, with what the simulator's own parameters went off."""
    precision = np.diag(fitted.prior_matrix)
    told = precision > 0
    off = fitted.prior_gradient[told] ** 2 / precision[told]
    return float(fitted.loss[here].sum() + off.sum())


def _with_those_that_fit_better(
    trials: Sequence[FittedHypothesis], logp: Array, score: Array, fitted: Array, cost: Array
) -> Array:
    """Return log-probabilities with rivals as probable as the first that fit the logs better than it.

    With few logs, what is predicted without one hangs on what the others tell of the simulator's own
    parameters. Where of two that explain the same share the one predicts better and the other, with no more
    numbers to it, fits better, neither is surer; of lags, neither is where it fits as well. ``fitted``: loss of
    the fits on the axis; ``cost``: logarithmic, of what the numbers of each cost.
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


def are_lags(one: FittedHypothesis, other: FittedHypothesis) -> bool:
    """Whether both are delays or lags of one axis."""
    effects = one.hypothesis.effect, other.hypothesis.effect
    late = all(effect_info(e.name).late for e in effects)
    return late and effects[0].axis == effects[1].axis


def _significance(
    t: FittedHypothesis, current: Array, layout: Layout, axis: int, *, explains: bool
) -> float:
    """Return how sure a trial is on an axis: by its gain, or by its size.

    The size counts where the effect acts itself and ``explains`` the axis: one that explains part
    of it has a size too, whatever the cause is.
    """
    gain = layout.significance(current, t.held_out, axis)
    own = t.hypothesis.effect.acts_on(axis + 1)
    return max(gain, amplitude_significance(t.fitted, layout.stretch)) if own and explains else gain


def likelier(loss: float, cost: float, *, than: tuple[float, float]) -> bool:
    """Whether a held-out loss with so many fitted numbers is likelier than another."""
    gain = 0.5 * _INDEPENDENT_BLOCKS * float(np.log(than[0] / loss))
    return gain > _PARAMETER_COST * (cost - than[1])


def smallest_likely_fall(loss: Array, cost: float) -> Array:
    """Return by how much a held-out loss has to fall for so many fitted numbers to be likelier than none."""
    return np.asarray(loss * -np.expm1(-2 * _PARAMETER_COST * cost / _INDEPENDENT_BLOCKS))


def log_ratio(left: Array, explained: Array, samples: Array) -> Array:
    """Return how much likelier a true cause is than one that leaves more, as `stand` counts.

    In each of several parts of the data, with ``samples`` residuals each: ``left``, mean square that
    the wrong one leaves above the noise, and ``explained``, that there is without either. The last
    dimension is that of the parts.
    """
    least = (samples * (1.0 + FORMULA_ERROR * explained)).sum(axis=-1)
    more = (samples * left).sum(axis=-1)
    return np.asarray(0.5 * _INDEPENDENT_BLOCKS * np.log1p(more / least))


def clearly_worse(loss: float, than: float) -> bool:
    """Whether a held-out loss is worse by more than a likelihood ratio of e^2."""
    return bool(0.5 * _INDEPENDENT_BLOCKS * np.log(loss / than) > 2.0)


def as_good_with_less(standing: AxisPosterior) -> list[RankedHypothesis]:
    """Return the rivals that need fewer numbers than the leader, and explain nearly as much.

    What they leave more may be the error of sensitivities that are not their own.
    """
    leader = standing.best
    return [
        r
        for r in standing.ranked[1:]
        if r.trial.cost < leader.trial.cost and r.score > leader.score - FORMULA_ERROR
    ]


def of_one_formula(standing: AxisPosterior) -> list[RankedHypothesis]:
    """Return the rivals that are held against the winner by next to nothing, and near enough for that.

    Fits that ended early are no ground for it.
    """
    first = standing.best
    least = first.score - NEXT_TO_NOTHING
    return [
        r
        for r in standing.ranked[1:]
        if all(effect_info(x.trial.hypothesis.effect.name).formula.exact for x in (r, first))
        and r.score > least
    ]
