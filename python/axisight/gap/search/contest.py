"""Decides every move: compares sets of causes that differ in one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.fitting.divergence import Diverged
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, trial
from axisight.gap.ranking.judgement import set_likelier, stand
from axisight.gap.ranking.posterior import AxisPosterior
from axisight.gap.screening.screening import kept_beside
from axisight.gap.search.state import SearchState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Context:
    """What moves work with: the fitter, the state that they change, and the hypotheses ``offered``.

    ``last``: the posteriors of the axes in the last round of the search.
    """

    fitter: ModelFitter
    state: SearchState
    settings: Settings
    offered: Sequence[Hypothesis] = ()
    last: Sequence[AxisPosterior] = ()


@dataclass(frozen=True)
class Alternative:
    """An effect that may replace causes, and the model where its fit starts; by default the model without them."""

    hypothesis: Hypothesis
    start: FittedModel | None = None


@dataclass(frozen=True)
class Proposal:
    """Causes of a model, and what may replace them.

    - ``axis`` (from 0): where the sets are compared; ``everywhere``: on all axes together.
    - ``gone``: the causes in question; ``instead``: one of these may replace them.
    - ``or_none``: they may also go out without replacement, if they are *needless*, or if it is *doubtful* that an
      effect of the library explains the axis.
    - ``leeway``: share of the explained loss that a replacement may leave more, for its formula error.
    - ``as_entered``: a replacement keeps the probability that it had when the cause was added.
    - ``never_stays``: the causes give way to a replacement that explains the axis, or go out, however likely they are.
    """

    axis: int
    gone: tuple[Hypothesis, ...]
    instead: tuple[Alternative, ...] = ()
    or_none: Literal["never", "needless", "doubtful"] = "never"
    everywhere: bool = False
    leeway: float = 0.0
    as_entered: bool = False
    never_stays: bool = False

    @property
    def labels(self) -> frozenset[str]:
        """The labels of the causes in question."""
        return frozenset(f.effect.label for f in self.gone)


@dataclass(frozen=True)
class Decision:
    """The model that is taken, and the posterior led by the effect that is new in it; None if causes only went out."""

    model: FittedModel
    standing: AxisPosterior | None


def decided(context: Context, proposal: Proposal) -> Decision | None:
    """Return the decision on a proposal; None if the causes stay."""
    fitter, model = context.fitter, context.state.model
    rest = [f for f in model.free if f.effect.label not in proposal.labels]
    if proposal.or_none == "needless":
        return _without(context, proposal, rest)
    without = fitter.fit(rest, model, lazy=True)
    if isinstance(without, Diverged):
        # A loop that swings without end lacks them.
        return None
    contest = _Contest(context, proposal, without)
    each = [trial(f, model.ending_with(f)) for f in proposal.gone]
    present = replace(each[-1], also=proposal.gone[:-1], idle=sum(t.idle for t in each))
    rivals = [t for one in proposal.instead if (t := contest.tried(rest, one)) is not None]
    if proposal.gone[:-1]:
        return contest.one_for(present, rivals)
    standing = contest.standing(rivals if proposal.never_stays else [present, *rivals])
    if standing is not None and rivals:
        standing = contest.standing(contest.with_second_fits(standing, present))
    goes = proposal.never_stays or proposal.or_none == "doubtful"
    if goes and (standing is None or _is_none(standing)):
        out = settled(fitter, rest, without)
        return None if isinstance(out, Diverged) else Decision(out, None)
    if standing is None or standing.best.trial is present:
        return None
    return contest.decision(standing)


def _without(context: Context, proposal: Proposal, rest: Sequence[Hypothesis]) -> Decision | None:
    """Return the model without the causes if its loss rises by less than a cause must remove."""
    model = context.state.model
    found = settled(context.fitter, rest, model)
    if isinstance(found, Diverged):
        # A loop that swings without end lacks them.
        return None
    counted = context.state.counted(None if proposal.everywhere else proposal.axis)
    little = found.total - model.total <= context.settings.smallest_gain * counted
    return Decision(found, None) if little else None


def _is_none(standing: AxisPosterior) -> bool:
    """Whether *none* and *unknown* together are likelier than the leader."""
    return standing.p_none + standing.p_unknown > standing.best.probability


class _Contest:
    """Fits and posteriors of sets of causes that share all but the causes in question."""

    def __init__(self, context: Context, proposal: Proposal, without: FittedModel) -> None:
        self.fitter, self.state, self.settings = context.fitter, context.state, context.settings
        self.proposal, self.without = proposal, without
        self.layout = context.state.layout
        self.place = None if proposal.everywhere else proposal.axis

    def tried(self, rest: Sequence[Hypothesis], one: Alternative) -> FittedHypothesis | None:
        """Return an alternative fitted beside the rest; None if it diverges or contains an effect of the rest."""
        if len(kept_beside(rest, one.hypothesis)) < len(rest):
            return None
        # Sensitivities of a start hold for its own values only.
        start, beside = (
            (self.without, self.without.free) if one.start is None else (one.start, rest)
        )
        found = self.fitter.fit([*beside, one.hypothesis], start, lazy=True)
        return None if isinstance(found, Diverged) else trial(one.hypothesis, found)

    def standing(self, trials: Sequence[FittedHypothesis]) -> AxisPosterior | None:
        """Return the posterior of single effects in the place in question; None if none lowers the loss."""
        found = stand(
            trials,
            held_out_loss(self.without),
            self.state.floor,
            self.layout,
            self.place,
            without=self.without,
            explained_share=self.settings.explained_share,
        )
        return None if found is None else found.usual_first().play_first()

    def one_for(
        self, several: FittedHypothesis, rivals: Sequence[FittedHypothesis]
    ) -> Decision | None:
        """Return the decision for the most probable effect that is likelier than several causes; None if none is."""
        first = self.standing(rivals)
        standing = None if first is None else self.standing(self.with_second_fits(first, several))
        if standing is None:
            return None
        floor = self._floor_for(several)
        for ranked in standing.ranked:
            if set_likelier(ranked.trial, several, self.without, floor, self.layout, self.place):
                return self.decision(standing)
            # An effect that leaves more cannot replace them.
            standing = standing.without(ranked.trial.label)
        return None

    def decision(self, standing: AxisPosterior) -> Decision:
        """Return the decision for the leader."""
        return Decision(standing.best.trial.fitted, replace(standing, axis=self.proposal.axis))

    def _floor_for(self, several: FittedHypothesis) -> Array:
        """Return the floor (n_blocks,), raised on the axis by what one effect may leave more than several."""
        here = self.layout.of(self.place)
        least = float(self.state.floor[here].sum())
        left = float(several.held_out[here].sum())
        explained = float(held_out_loss(self.without)[here].sum()) - left
        if self.proposal.leeway == 0.0 or explained <= 0.0:
            return self.state.floor
        share = max(left, least) + self.proposal.leeway * explained
        return np.asarray(np.where(here, share / least * self.state.floor, self.state.floor))

    def with_second_fits(
        self, standing: AxisPosterior, present: FittedHypothesis
    ) -> list[FittedHypothesis]:
        """Return the trials, fitted again with their own sensitivities: rivals of one cause, the best of several.

        Rivals out of reach keep their fits. A trial that diverges is left out.
        """
        rivals = [r for r in standing.ranked if r.trial is not present]
        if self.proposal.gone[:-1]:
            again = sorted((r.trial for r in rivals), key=lambda t: float(t.held_out.sum()))[:1]
        else:
            again = [r.trial for r in rivals if standing.in_reach(r)]
        fits = {id(t): self._settled(t) for t in again}
        found = [fits.get(id(r.trial), r.trial) for r in standing.ranked]
        return [t for t in found if t is not None]

    def _settled(self, one: FittedHypothesis) -> FittedHypothesis | None:
        found = settled(self.fitter, one.fitted.free, one.fitted)
        return None if isinstance(found, Diverged) else trial(one.hypothesis, found)
