"""Proposes rivals in the place of a cause whose probability may have changed since it was added."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from axisight.effects import Effect, effect_info
from axisight.gap.fit.tolerance_edges import bent
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.contest import Alternative, Context, Proposal
from axisight.gap.search.state import alike

# Most rivals of one cause that are tried.
RIVALS = 3
# Share of the leader's score that a rival needs if the leader was judged beside a cause that went out, or if the
# rival's gain is more even over time.
NEARLY = 0.8


def exchanged(context: Context) -> Iterator[Proposal]:
    """Propose rivals for each cause that was judged beside another set, with a bent simulator, or that leaves much."""
    state = context.state
    left, floor = state.left(), state.layout.by_axis(state.floor)
    final = {f.effect.label for f in state.model.free}
    crooked = bent(context.fitter, state.model) > 0
    for cause, standing in state.accepted:
        beside = {f.effect.label for f in cause.trial.fitted.free}
        if not beside <= final:
            rivals = _nearly_as_good(cause, standing)
        elif mends := mending(cause, context.last):
            rivals = mends
        elif beside < final or crooked:
            rivals = open_rivals(cause, state.standings_of(cause))
        elif left[standing.axis] > floor[standing.axis]:
            # The fit of a better law may have ended early.
            rivals = _nearly_as_good(cause, standing)
        else:
            continue
        seen = [*standing.ranked, *(r for s in context.last for r in s.ranked)]
        rivals = with_simpler_laws(cause, rivals, seen)
        alone = len(state.model.free) == 1
        instead = tuple(
            Alternative(r.trial.fitted.free[-1], r.trial.fitted if alone else state.model)
            for r in rivals
            if r.trial.label not in final
        )[:RIVALS]
        if instead:
            mine = next(f for f in state.model.free if f.effect.label == cause.trial.label)
            yield Proposal(standing.axis, (mine,), instead)


def _nearly_as_good(cause: RankedHypothesis, entered: AxisPosterior) -> list[RankedHypothesis]:
    """Return the rivals of the same axis that explained nearly as much as a cause when it was added."""
    axis = cause.trial.hypothesis.effect.axis
    near = (r for r in entered.ranked if r.score >= NEARLY * cause.score)
    return [r for r in near if r is not cause and r.trial.hypothesis.effect.axis == axis]


def open_rivals(
    cause: RankedHypothesis, entered: Sequence[AxisPosterior]
) -> list[RankedHypothesis]:
    """Return the rivals that could not be told from a cause when it was added, the likeliest first.

    ``entered``: the posteriors of its round.
    """
    label = cause.trial.label
    led = [s for s in entered if s.best.trial.label == label]
    stood = sorted((r for s in led for r in s.inseparable()), key=lambda r: -r.probability)
    likeliest = {r.trial.label: r for r in reversed(stood)}
    return [r for r in stood if r is likeliest[r.trial.label] and r.trial.label != label]


def with_simpler_laws(
    cause: RankedHypothesis, rivals: Sequence[RankedHypothesis], seen: Sequence[RankedHypothesis]
) -> list[RankedHypothesis]:
    """Return rivals of a cause; before it and each of them the simpler laws that it is like, if ``seen`` has them.

    A richer law is never judged without the plainer one, a composite without its first part, nor a current loop without
    the delay that it resembles.
    """
    out: list[RankedHypothesis] = []
    for rich in (cause, *rivals):
        effect = rich.trial.hypothesis.effect
        simpler = [(name, effect.axis) for name in _simpler(effect.name)]
        found = {
            law: r
            for r in reversed(seen)
            for law in simpler
            if (r.trial.hypothesis.effect.name, r.trial.hypothesis.effect.axis) == law
        }
        out += [found[law] for law in simpler if law in found]
        out += [rich] if rich is not cause else []
    first = {r.trial.label: r for r in reversed(out)}
    return [r for r in out if r is first[r.trial.label]]


def _simpler(effect: str) -> list[str]:
    """Return the law that an effect adds to, the first part of a composite, and the effect that it resembles."""
    info = effect_info(effect)
    relations = (info.plainer, info.resembles)
    return [*(x.law for x in relations if x is not None), *info.parts[:1]]


def mending(cause: RankedHypothesis, standings: Sequence[AxisPosterior]) -> list[RankedHypothesis]:
    """Return other laws of the same gear or dry friction that lead the axis of a cause beside it.

    Such a law is no second cause. It may be the right one, if its first fit had not converged.
    """
    first = cause.trial.hypothesis.effect
    leading = (s.best for s in standings if s.axis + 1 == first.axis)
    return [r for r in leading if _mends(r.trial.hypothesis.effect, first)]


def _mends(law: Effect, first: Effect) -> bool:
    return law.axis == first.axis and law.label != first.label and alike(law, first)
