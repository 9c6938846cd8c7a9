"""From a finished search to a verdict: none, explained, unknown or undecidable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import counted
from axisight.effects import Effect, effect_info
from axisight.gap.controller.torque_sensor import either, unseen_constant, with_torque_sensors
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import AxisVerdict, Candidate, Interval, VerdictKind
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.trace import Adjustment, log_odds
from axisight.gap.facts.withdrawal import Withdrawal
from axisight.gap.facts.wording import listed
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.ranking.intervals import intervals
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.ranking.twins import (
    about_twins,
    less_their_twins,
    open_twins,
    with_twins,
)
from axisight.gap.search.state import SearchState
from axisight.gap.verdict.separating_advice import separating_experiment

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisStanding:
    """How candidates stood on one axis (from 1) before any cause was taken in, the most probable first."""

    axis: int
    ranking: tuple[Candidate, ...]
    p_none: float
    p_unknown: float


@dataclass(frozen=True)
class Conclusion:
    """What the estimation logs say."""

    verdict: VerdictKind
    causes: tuple[NamedCause, ...]
    alternatives: tuple[Candidate, ...]
    equivalent: tuple[tuple[str, ...], ...]
    next_experiment: str | None
    ranking: tuple[Candidate, ...]
    p_none: float
    p_unknown: float
    axes: tuple[AxisVerdict, ...]
    checks: tuple[str, ...]
    effects: tuple[Effect, ...] = ()
    """The causes as they are added to the simulator."""
    withdrawn: Withdrawal | None = None
    """How the validation logs contradict what the estimation logs say, if they do."""
    standings: tuple[AxisStanding, ...] = ()
    """How candidates stood on each axis in the first round of the search."""
    ledger: tuple[Adjustment, ...] = ()
    """What the verdict itself changed of the probabilities."""

    def with_checks(self, more: Sequence[str]) -> Conclusion:
        """Return the same with further checks."""
        return replace(self, checks=(*self.checks, *more))

    def with_causes_behind(self, more: Sequence[NamedCause]) -> Conclusion:
        """Return the conclusion with further causes after its own; *none* becomes *explained*."""
        place = {c.axis: len(self.causes) + k for k, c in enumerate(more)}
        axes = tuple(
            replace(
                a,
                verdict="explained" if a.verdict == "none" else a.verdict,
                causes=(*a.causes, place[a.axis]),
            )
            if a.axis in place
            else a
            for a in self.axes
        )
        out = replace(self, causes=(*self.causes, *more), axes=axes)
        if self.verdict != "none":
            return out
        sure = max(c.probability for c in more)
        return replace(out, verdict="explained", p_none=0.0, p_unknown=1.0 - sure)

    def without_causes(self, verdict: VerdictKind) -> Conclusion:
        """Return the conclusion with another verdict and without causes; these stay among the candidates."""
        return replace(
            self,
            verdict=verdict,
            causes=(),
            equivalent=(),
            alternatives=self.ranking[:_ALTERNATIVES],
            axes=tuple(replace(a, causes=(), verdict=verdict) for a in self.axes),
        )

    def ranked_on(self, axis: int) -> Conclusion:
        """Return an *unknown* conclusion with the candidates of an axis (from 1), the one with most left to explain.

        Unchanged for other verdicts, or if no candidate improves that axis.
        """
        standing = next((s for s in self.standings if s.axis == axis), None)
        if self.verdict != "unknown" or standing is None:
            return self
        named = {c.label for c in self.causes}
        return replace(
            self,
            ranking=standing.ranking,
            alternatives=tuple(c for c in standing.ranking if c.label not in named)[:_ALTERNATIVES],
            p_none=standing.p_none,
            p_unknown=standing.p_unknown,
        )

    def rivals_of(self, label: str) -> tuple[str, ...]:
        """Return the labels that the data cannot tell from a cause, without those that are causes themselves."""
        causes = {c.label for c in self.causes}
        rivals = [x for group in self.equivalent if label in group for x in group]
        return tuple(dict.fromkeys(x for x in rivals if x not in causes))


# Candidates that a verdict lists.
_ALTERNATIVES = 5
# Probability of a cause that the controller's law shows. A limit of the supply, say, looks like one of the drive.
_SHOWN = 0.99
_MORE_TIME = "Diagnose again with a longer time limit (`--time-limit`)."


def conclude(
    found: SearchState,
    settings: Settings,
    *,
    stands_out: bool,
    shown: Sequence[AlgebraicCause] = (),
) -> Conclusion:
    """Draw the verdict from a finished search.

    ``stands_out``: whether the plain torque error of the re-fitted simulator lies above the noise. Otherwise
    an unexplained residual counts as noise of an unexpected colour, up to what noise can be. ``shown``: causes
    that the logs show by themselves; they come first. A gap is *unknown* where the time limit stopped the search.
    """
    accepted = found.accepted
    explained = found.explained()
    labels = {r.trial.label for r, _ in accepted}
    strongest = _strongest(found)
    ranking = () if strongest is None else tuple(_candidate(r) for r in strongest.ranked)
    p_none = 1.0 if strongest is None else strongest.p_none
    p_unknown = 0.0 if strongest is None else strongest.p_unknown
    if shown and not accepted:
        ranking = (_candidate_shown(shown[0]),)
        p_none, p_unknown = 0.0, 1.0 - _SHOWN
    n_axes = found.layout.n_axes
    ranking = with_twins(ranking, n_axes)
    groups = [_open(r, s, labels) for r, s in accepted]
    open_groups = tuple(g for g in groups if len(g) > 1)
    beyond_colour = _most(found, found.baseline.loss) > OF_COLOUR
    gap = (stands_out or beyond_colour) and _significant(found, settings)
    if not accepted and not shown:
        verdict: VerdictKind = "unknown" if gap else "none"
    elif (accepted or gap) and _too_little(found, explained, settings):
        verdict = "unknown"
    else:
        verdict = "undecidable" if open_groups else "explained"
    believed = verdict in ("explained", "undecidable") or found.by_axis
    if found.stopped is not None and verdict != "none":
        # What was found is named; nobody looked for what else there is.
        verdict = "unknown"
        if strongest is None:
            p_none, p_unknown = 0.0, 1.0
    searched = [_named(r, s, i, found.model, labels) for i, (r, s) in enumerate(accepted)]
    causes, effects = with_torque_sensors(
        (*map(named_shown, shown), *searched) if believed else (),
        (*(x.effect for x in shown), *found.model.effects) if believed else (),
    )
    gains = either(causes, unseen_constant(settings))
    if gains and verdict == "explained":
        verdict = "undecidable"
    torn = {one for one, _ in gains}
    causes = tuple(c.adjusted("either", 0.5) if c.label in torn else c for c in causes)
    open_groups += gains
    advice = advice_unknown() if verdict == "unknown" else None
    if found.stopped is not None and verdict == "unknown":
        advice = _MORE_TIME
    if verdict == "undecidable":
        advice = separating_experiment(open_groups[0])
    named = {c.label for c in causes}
    return Conclusion(
        verdict=verdict,
        causes=less_their_twins(causes, n_axes),
        alternatives=tuple(c for c in ranking if c.label not in named)[:_ALTERNATIVES],
        equivalent=(*open_groups, *open_twins(causes, n_axes)) if believed else (),
        next_experiment=advice,
        ranking=ranking,
        p_none=p_none,
        p_unknown=p_unknown,
        axes=_axes(found, settings, causes, gap=gap),
        checks=(
            *(x.says for x in shown),
            *about_twins(causes, n_axes),
            *_checks(found, settings, explained),
        ),
        effects=effects,
        standings=tuple(_standing(s, n_axes) for s in found.rounds[0].standings),
    )


def _standing(posterior: AxisPosterior, n_axes: int) -> AxisStanding:
    ranking = with_twins(tuple(map(_candidate, posterior.ranked)), n_axes)
    return AxisStanding(posterior.axis + 1, ranking, posterior.p_none, posterior.p_unknown)


# Share of the loss that the true law may leave, since formulas differ. More than that still counts as noise and scatter
# of the simulator up to this mean square above the floor.
_OF_A_LAW = 0.1
_OF_NOISE = 4.0


def _too_little(found: SearchState, explained: float, settings: Settings) -> bool:
    """Whether the causes explain too little, or leave so much in closed loop that another law must be the cause."""
    if explained < settings.explained_share:
        return True
    left = float(found.left().sum() / found.layout.samples().sum())
    # By inverse dynamics, a real machine has much that no effect explains.
    return not found.adds_up and explained < 1.0 - _OF_A_LAW and left > _OF_NOISE


def named_shown(cause: AlgebraicCause) -> NamedCause:
    """Return a cause that the logs show without a fit as a cause of the verdict."""
    info = effect_info(cause.name)
    units = {p.name: p.unit for p in info.parameters}
    return NamedCause(info.name, cause.axis, _SHOWN, dict(cause.values), units, info.family, _SHOWN)


def _strongest(found: SearchState) -> AxisPosterior | None:
    """Return the posterior from which the first cause was added; without a cause that of the axis with most to explain.

    Causes that were added and removed later are left out, unless what replaced them left them open as rivals.
    """
    first = found.rounds[0]
    if not first.accepted:
        left = found.to_explain() / found.layout.samples()
        return max(first.standings, key=lambda s: float(left[s.axis]), default=None)
    cause, standing = first.accepted[0]
    taken = {r.trial.label for x in found.rounds for r, _ in x.accepted}
    gone = taken - {r.trial.label for r, _ in found.accepted}
    if cause.trial.label in gone:
        after = _gave_way(cause, standing.axis, found)
        standing, gone = (standing, gone) if after is None else (after, gone - {cause.trial.label})
    for label in gone:
        standing = standing.without(label)
    return standing


def _gave_way(cause: RankedHypothesis, axis: int, found: SearchState) -> AxisPosterior | None:
    """Return the posterior in which a removed cause is a rival of its replacement; None if there is none."""
    label = cause.trial.label
    for winner, standing in found.accepted:
        beside = {f.effect.label for f in winner.trial.fitted.free}
        ranked = {r.trial.label for r in standing.ranked}
        if standing.axis == axis and label in ranked and label not in beside:
            return standing
    return None


def _open(winner: RankedHypothesis, standing: AxisPosterior, accepted: set[str]) -> tuple[str, ...]:
    """Return the label of a cause and of the rivals that the data cannot tell from it; causes are no rivals."""
    rivals = [r.trial.label for r in standing.inseparable()]
    return (winner.trial.label, *(x for x in rivals if x not in accepted))


def _axes(
    found: SearchState, settings: Settings, causes: Sequence[NamedCause], *, gap: bool
) -> tuple[AxisVerdict, ...]:
    """Return what the estimation logs say of each axis; `axis_verdicts` has the last word on its verdict."""
    excess, removed = found.to_explain(), found.removed()
    samples = found.layout.samples()
    out = []
    for i in range(found.layout.n_axes):
        mine = tuple(
            k for k, c in enumerate(causes) if i + 1 in (c.axes or ()) or c.axis in (i + 1, None)
        )
        share = float(removed[i] / excess[i]) if excess[i] > 0 else 0.0
        if not gap or excess[i] / samples[i] <= settings.largest_scatter:
            verdict: VerdictKind = "explained" if any(causes[k].axis for k in mine) else "none"
        else:
            believed = bool(causes) and share >= settings.explained_share
            verdict = "explained" if believed else "unknown"
        out.append(AxisVerdict(i + 1, verdict, float(excess[i] / samples[i]), share, mine))
    return tuple(out)


# Mean square of the fit above the floor up to which noise may have another colour than assumed. On 119 machines that
# were called *none* it was at most 0.4 (held out) where nothing was missing, and 1.5 to 2 on three with a cause.
OF_COLOUR = 1.0


def _significant(found: SearchState, settings: Settings) -> bool:
    """Whether the re-fitted simulator leaves more than floor and formula error."""
    return _most(found, held_out_loss(found.baseline)) > settings.largest_scatter


def _most(found: SearchState, loss: Array) -> float:
    """Return the mean square above the floor, on the axis with most, of a loss by block (n_blocks,)."""
    return float(np.max(found.layout.by_axis(loss - found.floor) / found.layout.samples()))


def _candidate_shown(cause: AlgebraicCause) -> Candidate:
    # Each sample is a trial of its own.
    sure = float(np.sqrt(cause.samples))
    return Candidate(cause.name, cause.axis, _SHOWN, cause.explained, sure, "shown_by_the_logs")


def _candidate(ranked: RankedHypothesis) -> Candidate:
    effect = ranked.trial.hypothesis.effect
    return Candidate(
        effect.name,
        effect.first_axis,
        ranked.probability,
        ranked.score,
        ranked.significance,
        ranked.trial.fitted.status,
        effect.axes,
    )


def _named(
    ranked: RankedHypothesis,
    standing: AxisPosterior,
    position: int,
    model: FittedModel,
    accepted: set[str],
) -> NamedCause:
    effect = model.effects[position]
    values = effect.parameters or {}
    info = effect_info(effect.name)
    std = {name: s for (place, name), s in model.std.items() if place == position}
    mine = model.free[position]
    found = intervals(effect, mine.free, std, mine.sure)
    for p in info.parameters:
        # Orders of a ripple are chosen, not fitted.
        if p.name.startswith("order_") and values.get(p.name):
            found[p.name] = Interval(values[p.name], values[p.name], values[p.name])
    units = {p.name: p.unit for p in info.parameters}
    # Other causes are no rivals. Whether anything explains the axis is judged with all causes together.
    rivals = [r for r in standing.ranked if r is ranked or r.trial.label not in accepted]
    whole = max(sum(r.probability for r in rivals), 1e-300)
    place = effect.place
    kin = [
        r for r in rivals if r.family == info.family and r.trial.hypothesis.effect.place == place
    ]
    alone = ranked.probability / whole
    family = min(max(sum(r.probability for r in kin) / whole, alone), 1.0)
    where, axes = effect.first_axis, effect.axes
    entry = Adjustment("beside_causes", effect.label, -log_odds(whole))
    ledger = () if whole == 1 else (entry,)
    return NamedCause(effect.name, where, alone, found, units, info.family, family, axes, ledger)


def _checks(found: SearchState, settings: Settings, explained: float) -> tuple[str, ...]:
    tried = sum(len({r.trial.label for s in x.standings for r in s.ranked}) for x in found.rounds)
    before = held_out_loss(found.baseline, like=found.model)
    size = float(found.baseline.samples.sum())
    left = float((held_out_loss(found.model) - found.floor).sum()) / size
    out = [
        f"{tried} fits of candidate effects compared in {counted(len(found.rounds), 'round')}, on data left "
        "out of each fit.",
        f"Mean square of the residual above the floor: {(before - found.floor).sum() / size:.3f} "
        f"re-fitted, {left:.3f} with the causes (1 is noise plus {100 * settings.model_error:g} % model error).",
        f"Share of the explainable error removed on held-out estimation data: {100 * explained:.1f} %.",
    ]
    if refuted := np.flatnonzero(found.noise < 1.0).tolist():
        less = listed([f"{1 / found.noise[i]:.2g} times on axis {i + 1}" for i in refuted])
        out.append(
            "The estimated noise is more than what the model leaves on data left out of its fit: "
            f"{less}. What the model leaves is the floor there."
        )
    if found.stopped is not None:
        by_then = ", ".join(found.stopped.causes) or "none"
        out.append(f"{found.stopped.words} Causes of finished rounds: {by_then}.")
    out += [f"Candidate {k} could not be tried: {v}" for k, v in sorted(found.skipped.items())]
    return tuple(out)


def advice_unknown() -> str:
    """Return what to do about a gap that no effect explains."""
    return (
        "Look at the gap map: in which bands and regimes do the unknown axes have their gap? Then record the same "
        "motion twice. What repeats is an effect of the machine, what does not is a disturbance."
    )
