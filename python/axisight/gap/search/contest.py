"""Sets of causes that differ in one place, held against one another: how every move is decided."""

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

    ``last``: how the axes stood in the last round of the search.
    """

    fitter: ModelFitter
    state: SearchState
    settings: Settings
    offered: Sequence[Hypothesis] = ()
    last: Sequence[AxisPosterior] = ()


@dataclass(frozen=True)
class Alternative:
    """An effect that may be in the place of causes, and a model to fit it from; by default the one without them."""

    hypothesis: Hypothesis
    start: FittedModel | None = None


@dataclass(frozen=True)
class Proposal:
    """Causes of a model, and what may be there instead.

    ``gone``: the causes; ``instead``: one of these in their place. ``or_none``: nothing in their place, where they
    are *needless*, or where it is *doubtful* whether an effect of the library is what they stand for. ``axis``
    (from 0): where all are judged, or ``everywhere``. ``leeway``: share of what the causes explain that one in their
    place may leave more, since formulas of it differ as much. ``as_entered``: what takes the place of a cause that
    it could not be told from keeps the probability that it had then.
    """

    axis: int
    gone: tuple[Hypothesis, ...]
    instead: tuple[Alternative, ...] = ()
    or_none: Literal["never", "needless", "doubtful"] = "never"
    everywhere: bool = False
    leeway: float = 0.0
    as_entered: bool = False
    entered: AxisPosterior | None = None

    @property
    def labels(self) -> frozenset[str]:
        """The labels of the causes in question."""
        return frozenset(f.effect.label for f in self.gone)


@dataclass(frozen=True)
class Decision:
    """What takes the place of causes: a model, and how what is new in it stands; nothing new where they go out.

    The same model where a cause stays, with how it stands beside the others.
    """

    model: FittedModel
    standing: AxisPosterior | None


def decided(context: Context, proposal: Proposal) -> Decision | None:
    """Return what takes the place of causes, or how they stand; None where they stay as they stood."""
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
    standing = contest.standing([present, *rivals])
    if standing is not None and rivals:
        standing = contest.standing(contest.with_second_fits(standing, present))
    if proposal.or_none == "doubtful" and (standing is None or _is_none(standing)):
        out = settled(fitter, rest, without)
        return None if isinstance(out, Diverged) else Decision(out, None)
    return None if standing is None else contest.decided(standing, present)


def _without(context: Context, proposal: Proposal, rest: Sequence[Hypothesis]) -> Decision | None:
    """Return the model without causes, where it leaves no more than what a cause has to take away."""
    model = context.state.model
    found = settled(context.fitter, rest, model)
    if isinstance(found, Diverged):
        # A loop that swings without end lacks them.
        return None
    counted = context.state.counted(None if proposal.everywhere else proposal.axis)
    little = found.total - model.total <= context.settings.smallest_gain * counted
    return Decision(found, None) if little else None


def _is_none(standing: AxisPosterior) -> bool:
    """Whether nothing, or something unknown, is likelier than what leads."""
    return standing.p_none + standing.p_unknown > standing.best.probability


class _Contest:
    """Sets of causes with the same rest: fits, and how they stand."""

    def __init__(self, context: Context, proposal: Proposal, without: FittedModel) -> None:
        self.fitter, self.state, self.settings = context.fitter, context.state, context.settings
        self.proposal, self.without = proposal, without
        self.layout = context.state.layout
        self.place = None if proposal.everywhere else proposal.axis

    def tried(self, rest: Sequence[Hypothesis], one: Alternative) -> FittedHypothesis | None:
        """Return an alternative beside the rest; None if it cannot be simulated, or contains some of the rest."""
        if len(kept_beside(rest, one.hypothesis)) < len(rest):
            return None
        found = self.fitter.fit([*rest, one.hypothesis], one.start or self.without, lazy=True)
        return None if isinstance(found, Diverged) else trial(one.hypothesis, found)

    def standing(self, trials: Sequence[FittedHypothesis]) -> AxisPosterior | None:
        """Return how single effects stand in the place in question."""
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
        """Return the first effect, the most probable before others, that is likelier than several; None without."""
        first = self.standing(rivals)
        standing = None if first is None else self.standing(self.with_second_fits(first, several))
        if standing is None:
            return None
        floor = self._floor_for(several)
        for ranked in standing.ranked:
            if set_likelier(ranked.trial, several, self.without, floor, self.layout, self.place):
                return self.decision(standing)
            # What leaves more than that is none in their place.
            standing = standing.without(ranked.trial.label)
        return None

    def decided(self, standing: AxisPosterior, present: FittedHypothesis) -> Decision | None:
        """Return the decision for what leads; where a cause stays, how it does, if all its open rivals were tried."""
        entered = self.proposal.entered
        if entered is not None:
            standing = standing.told_by_other_axes(entered)
        if standing.best.trial is not present:
            return self.decision(standing)
        if entered is None:
            return None
        judged = replace(standing, axis=entered.axis).with_untried(entered)
        return Decision(self.state.model, judged)

    def decision(self, standing: AxisPosterior) -> Decision:
        """Return the decision for what leads."""
        return Decision(standing.best.trial.fitted, replace(standing, axis=self.proposal.axis))

    def _floor_for(self, several: FittedHypothesis) -> Array:
        """Return the floor (n_blocks,), raised by what one in the place of several may leave more than they do."""
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
        """Return the trials with sensitivities of their own: all rivals of one cause, the best of several causes.

        One that cannot be simulated with these is none.
        """
        rivals = [r.trial for r in standing.ranked if r.trial is not present]
        best = min(rivals, key=lambda t: float(t.held_out.sum()), default=None)
        again = [t for t in rivals if t is best or not self.proposal.gone[:-1]]
        fits = {id(t): self._settled(t) for t in again}
        found = [fits.get(id(r.trial), r.trial) for r in standing.ranked]
        return [t for t in found if t is not None]

    def _settled(self, one: FittedHypothesis) -> FittedHypothesis | None:
        found = settled(self.fitter, one.fitted.free, one.fitted)
        return None if isinstance(found, Diverged) else trial(one.hypothesis, found)
