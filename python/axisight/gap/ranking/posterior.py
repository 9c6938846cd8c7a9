"""The hypotheses of one axis with their probabilities, and what changes these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod

from axisight.effects import Effect, effect_info
from axisight.gap.facts.trace import Adjustment, log_odds
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.formula_error import NEXT_TO_NOTHING
from axisight.gap.ranking.likelihood import FORMULA_ERROR

TINY = 1e-300
"""Smallest weight that is divided by."""


def _against_the_best(standing: AxisPosterior) -> dict[str, float]:
    """Return the odds of each candidate against the best one of the axis, by label."""
    return {r.trial.label: r.probability / standing.best.probability for r in standing.ranked}


@dataclass(frozen=True)
class RankedHypothesis:
    """A fitted hypothesis with its rank on one axis.

    ``score``: share of the loss above the floor that it removes there; ``gain``: fall of the mean square of the
    residual there; ``significance`` of that gain [standard deviations]; ``probability`` beside all candidates of
    the axis, *none* and *unknown*.
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


# Odds against the leader that no better fit makes up for: it would have to leave a fifth of the loss it leaves now.
_OUT_OF_REACH = 1e-20

# Ratio of probabilities from which two hypotheses count as equally likely; fits are not more exact.
_AS_LIKELY = 0.99


def in_order(ranked: Sequence[RankedHypothesis], axis: int | None) -> tuple[RankedHypothesis, ...]:
    """Return hypotheses, the most probable first. Among equally likely ones, those that act on ``axis`` (from 0)."""
    found = sorted(ranked, key=lambda r: (-r.probability, -r.score, r.trial.label))

    def behind(r: RankedHypothesis) -> tuple[bool, bool]:
        level = r.probability >= _AS_LIKELY * found[0].probability
        elsewhere = axis is not None and r.trial.hypothesis.effect.axis != axis + 1
        return not level, level and elsewhere

    return tuple(sorted(found, key=behind))


@dataclass(frozen=True)
class AxisPosterior:
    """The candidates of one axis (from 0) with their probabilities, best first, and *none* and *unknown*.

    ``ledger``: the entries that make up the log-weights, in order. Only `adjusted`, `without`, `exchanged`
    and `joined` change a probability, and each writes an entry.
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

    def in_reach(self, one: RankedHypothesis) -> bool:
        """Whether a candidate may lead after a better fit of its own."""
        return one.probability > _OUT_OF_REACH * self.best.probability

    def adjusted(self, rule: str, odds: Mapping[str, float]) -> AxisPosterior:
        """Return the posterior with the odds of candidates, by label, multiplied by a factor."""
        weighed = [(odds.get(r.trial.label, 1.0), r) for r in self.ranked]
        changed = [(times, r) for times, r in weighed if times != 1]
        left = [(times * r.probability, r) for times, r in weighed]
        entries = [Adjustment(rule, r.trial.label, log_odds(x)) for x, r in changed]
        found = self._of(left, entries)
        return replace(found, ranked=in_order(found.ranked, self.axis)) if changed else found

    def without(self, *labels: str) -> AxisPosterior:
        """Return the posterior without some candidates, by label."""
        left = [(r.probability, r) for r in self.ranked if r.trial.label not in labels]
        gone = [r.trial.label for r in self.ranked if r.trial.label in labels]
        return self._of(left, [Adjustment("not_a_cause", x, log_odds(0.0)) for x in gone])

    def _of(
        self, weighed: Sequence[tuple[float, RankedHypothesis]], entries: Sequence[Adjustment]
    ) -> AxisPosterior:
        """Return the posterior for other weights of candidates, normalised."""
        whole = sum(weight for weight, _ in weighed) + self.p_none + self.p_unknown
        return AxisPosterior(
            self.axis,
            tuple(replace(r, probability=weight / whole) for weight, r in weighed),
            self.p_none / whole,
            self.p_unknown / whole,
            (*self.ledger, *entries),
        )

    def exchanged(self, rule: str, one: RankedHypothesis) -> AxisPosterior:
        """Return the posterior with another candidate first; the two exchange their probabilities."""
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
        """Return the posterior with ``into`` first, in the place of ``parts`` and with their total probability."""
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

    def of_member(self, member: FittedHypothesis) -> AxisPosterior:
        """Return the posterior of one member of the leading set: the members of a set stand and fall together."""
        label = self.best.trial.label
        ledger = (
            replace(x, hypothesis=member.label) if x.hypothesis == label else x for x in self.ledger
        )
        first = replace(self.best, trial=member)
        return replace(self, ranked=(first, *self.ranked[1:]), ledger=tuple(ledger))

    def led_by(self, first: RankedHypothesis, rule: str | None = None) -> AxisPosterior:
        """Return the posterior with another candidate first; probabilities stay."""
        entry = () if rule is None else (Adjustment(rule, first.trial.label, 0.0),)
        rest = (r for r in self.ranked if r is not first)
        return replace(self, ranked=(first, *rest), ledger=(*self.ledger, *entry))

    def without_first(self, count: int) -> AxisPosterior:
        """Return the posterior without its first ``count`` candidates."""
        return self.without(*(r.trial.label for r in self.ranked[:count]))

    def with_axes_it_leads(self, others: Sequence[AxisPosterior]) -> AxisPosterior:
        """Return the posterior with each rival at its lowest odds against the leader on any axis that the leader leads.

        ``others``: the posteriors of the other axes that it leads. An effect that moves several axes shows on all of
        them; a rival may do as well on one axis and worse on another.
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
        """Return the posterior with all candidates weighed by axes where a rival of the leader surely leads.

        ``others``: the posteriors of these axes. An effect that shows on two axes is judged by both.
        """
        there = [_against_the_best(other) for other in others]
        odds = {
            r.trial.label: prod(min(x.get(r.trial.label, 0.0), 1.0) for x in there)
            for r in self.ranked
        }
        return self.adjusted("rival_leads", odds)

    def inseparable(self) -> list[RankedHypothesis]:
        """Return the candidates that the data cannot tell apart, the leader first; the leader alone if it is clear.

        If many rivals are likely only together, the likeliest of them is returned.
        """
        winner, rivals = self.best, self.ranked[1:]
        bar = _RIVAL * winner.probability / (1 - _RIVAL)
        together = sum(r.probability for r in rivals)
        if together > _RIVALS * winner.probability / (1 - _RIVALS):
            bar = min(bar, rivals[0].probability)
        return [winner, *(r for r in rivals if r.probability >= bar)]

    def usual_first(self) -> AxisPosterior:
        """Return the posterior with the odds of common look-alikes of the leader multiplied by their prior odds.

        Where two effects explain the data equally well, the common one is more often the cause.
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
        """Return the posterior led by backlash if the leader is a gear without stiffness around its middle.

        Such a gear has backlash, whichever formula fits better: the ends of the gap are softer or harder by machine.
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


# Loss of stiffness from which a gear has no stiffness in its middle, and the share of the leader's score that
# backlash needs to be named.
_NO_MIDDLE = 0.95

_AS_PLAY = 0.8

# Probability of a rival, beside the leader alone, from which the cause stays open; and of all rivals together.
_RIVAL = 0.2

_RIVALS = 0.25


def as_good_with_less(standing: AxisPosterior) -> list[RankedHypothesis]:
    """Return the rivals that explain nearly as much as the leader with fewer numbers.

    The difference may come from sensitivities that were taken at another model.
    """
    leader = standing.best
    return [
        r
        for r in standing.ranked[1:]
        if r.trial.cost < leader.trial.cost and r.score > leader.score - FORMULA_ERROR
    ]


def of_one_formula(standing: AxisPosterior) -> list[RankedHypothesis]:
    """Return the rivals with an exact formula that come near a leader with an exact formula.

    They need a full fit before they are compared, since such small differences decide.
    """
    first = standing.best
    least = first.score - NEXT_TO_NOTHING
    return [
        r
        for r in standing.ranked[1:]
        if all(effect_info(x.trial.hypothesis.effect.name).formula.exact for x in (r, first))
        and r.score > least
    ]
