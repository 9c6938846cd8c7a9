"""Search for causes: in each round try every effect on every axis, add the best of each axis, then make moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.fitting.divergence import Diverged, must_hold
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.trace import Stop
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.fit.time_limit import TimeLimit, TimeUp
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, falls
from axisight.gap.ranking.likelihood import FORMULA_ERROR
from axisight.gap.ranking.ordinary_first import is_lacked, ordinary_first
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening.column_cache import ColumnCache
from axisight.gap.screening.free_bodies import FreeBodies
from axisight.gap.screening.ordinary_together import OrdinaryTogether
from axisight.gap.screening.promise import HOPELESS
from axisight.gap.screening.screening import kept_beside
from axisight.gap.screening.search_round import Progress, SearchRound, fresh, interact, same
from axisight.gap.search.composites import named_simply
from axisight.gap.search.contest import Context
from axisight.gap.search.moves import AFTER_EACH_ROUND, AT_THE_END, finish, make
from axisight.gap.search.pairs import Pair, Pairs
from axisight.gap.search.rivals import NEARLY
from axisight.gap.search.state import OPEN, Round, SearchState
from axisight.statistics.tails import normal_deviate

Array = NDArray[np.float64]

# Each round adds a cause on every axis that has one. More rounds than this fit a shape, not causes.
_MOST_ROUNDS = 8


def search(
    fitter: ModelFitter,
    candidates: Callable[[FittedModel], list[Hypothesis]],
    expected: Array,
    settings: Settings,
    progress: Progress,
    limit: TimeLimit,
    baseline: FittedModel | None = None,
) -> SearchState:
    """Search for the causes of a gap.

    ``candidates``: makes the hypotheses from the residual of a model; ``expected`` (n_axes,): mean square of the
    weighted residual of noise alone. ``limit``: where it ends the search, the causes of finished rounds stay.
    ``baseline``: the re-fitted simulator, if it is there already.
    """
    baseline = baseline or refitted(fitter, progress)
    floor = expected[baseline.axis] * baseline.samples
    layout = layout_of(baseline, fitter.silent)
    out = SearchState(baseline, baseline, floor, layout, adds_up=fitter.adds_up)
    limited = fitter.until(limit)
    try:
        _add_causes(limited, candidates, out, settings, progress)
        limited.work.stage = "moves"
        make(AT_THE_END, Context(limited, out, settings, last=out.rounds[-1].standings))
        finish(limited, out)
    except TimeUp:
        # A round that was cut short adds nothing: its leaders have not met all their rivals.
        causes = tuple(f.effect.label for f in out.model.free)
        out.stopped = Stop(limit.limit_s, out.number, limited.work.stage, causes)
        out.rounds = out.rounds or [Round((), (), out.left())]
    if fitter.adds_up:
        out.refute_floor()
    fitter.work.stage = "measuring"
    return out


def _add_causes(
    fitter: ModelFitter,
    candidates: Callable[[FittedModel], list[Hypothesis]],
    out: SearchState,
    settings: Settings,
    progress: Progress,
) -> None:
    """Add causes round by round until a round finds none."""
    refused: set[str] = set()
    kept = ColumnCache()
    together: bool | Diverged = True

    def offered_beside(model: FittedModel) -> list[Hypothesis]:
        return fresh(candidates(model), model, refused)

    for number in range(1, _MOST_ROUNDS + 1):
        out.number = number
        least = out.least_falls(settings)
        round_ = SearchRound(
            fitter,
            out.model,
            out.floor,
            out.layout,
            least,
            settings,
            progress,
            kept,
            out.mends,
            offered_beside,
        )
        offered = candidates(out.model)
        options = fresh(offered, out.model, refused)
        if not isinstance(together, Diverged):
            together = _took_ordinary(fitter, options, out, settings, round_, progress)
            if together is True:
                continue
        trials = round_.refined(round_.run(options, number), options, number)
        standings, taken = _judged(round_, trials, out, settings, len(options))
        if round_.first(standings, trials) not in {r.trial.label for r, _ in taken}:
            # The leader that others waited for is no cause.
            before = trials
            trials = round_.run_waiting(trials, options, number)
            trials = round_.refined(trials, options, number, even_felt=True)
            if not same(trials, before):
                standings, taken = _judged(round_, trials, out, settings, len(options))
        out.skipped |= round_.skipped
        out.sensitivities |= round_.sensitivities
        # The round has its causes once they are in the model.
        out.rounds.append(Round(standings, (), out.left()))
        if not taken:
            break
        diverged = _take_in(round_, out, taken, progress)
        out.rounds[-1] = replace(out.rounds[-1], accepted=taken)
        if diverged is not None:
            # Together they diverge: refuse the first, which promised most.
            refused.add(taken[0][0].trial.label)
            out.skipped[taken[0][0].trial.label] = str(diverged)
            continue
        fitter.work.stage = "moves"
        refused |= make(AFTER_EACH_ROUND, Context(fitter, out, settings, offered))
        if _settled(out, settings) or len(out.model.free) >= settings.max_causes:
            break


def _took_ordinary(
    fitter: ModelFitter,
    options: Sequence[Hypothesis],
    out: SearchState,
    settings: Settings,
    round_: SearchRound,
    progress: Progress,
) -> bool | Diverged:
    """Add what every machine has and the simulator does not tell, on all axes at once; return whether there is any.

    Where the model diverges with it, nothing is added: return how.
    """
    fitter.work.stage = "screening"
    bodies = FreeBodies(fitter, out.layout, settings, FreeBodies.among(options))
    together = OrdinaryTogether(out.model, out.floor, bodies)
    taken = tuple(together.found(options))[: max(settings.max_causes - len(out.model.free), 0)]
    if not taken:
        return False
    standings = tuple({s.axis: s for _, s in taken}.values())
    left = out.left()
    diverged = _take_in(round_, out, taken, progress)
    if diverged is not None:
        out.skipped[" + ".join(r.trial.label for r, _ in taken)] = str(diverged)
        return diverged
    out.rounds.append(Round(standings, taken, left))
    out.bodies = out.bodies or bodies
    return True


def refitted(fitter: ModelFitter, progress: Progress) -> FittedModel:
    """Return the re-fitted simulator without effects. The first halves of the logs are fitted first, for speed."""
    progress("re-fitting the simulator", 0, 1)
    fitter.work.stage = "refit"
    halves = fitter.beginnings()
    if halves is None:
        out = must_hold(fitter.fit([], refreshes=1))
    else:
        out = must_hold(fitter.fit([], must_hold(halves.fit([]))))
    progress("re-fitting the simulator", 1, 1)
    return out


def _judged(
    round_: SearchRound,
    trials: Sequence[FittedHypothesis],
    state: SearchState,
    settings: Settings,
    tried: int,
) -> tuple[tuple[AxisPosterior, ...], tuple[tuple[RankedHypothesis, AxisPosterior], ...]]:
    """Return the posterior of every axis, and the causes to add, at most up to ``settings.max_causes``."""
    round_.fitter.work.stage = "judging"
    standings = tuple(round_.standings(trials))
    taken = _taken(round_, trials, standings, state, settings, tried)
    room = settings.max_causes - len(state.model.free)
    return standings, taken[: max(room, 0)]


def _taken(
    round_: SearchRound,
    trials: Sequence[FittedHypothesis],
    standings: Sequence[AxisPosterior],
    state: SearchState,
    settings: Settings,
    tried: int,
) -> tuple[tuple[RankedHypothesis, AxisPosterior], ...]:
    """Return the leaders of all axes that are causes and do not affect each other's axis."""
    fall = falls(trials, round_.current, state.layout)
    place = {t.label: i for i, t in enumerate(trials)}
    found: list[tuple[RankedHypothesis, AxisPosterior]] = []
    leaders: list[tuple[int, int]] = []

    causes = {s.axis: _led_by_a_cause(s, round_.fitter, state, settings, tried) for s in standings}
    for standing in best_fit_first(standings, fall, place):
        led = causes[standing.axis]
        if led is None or _beaten_at_home(led, causes):
            continue
        led = led.with_axes_rivals_lead(
            [s for s in standings if _rival_leads(led, s, fall, place, state, settings)]
        )
        least = state.least_falls(settings)
        led = led.with_axes_it_leads(
            [s for s in standings if _leads(led, s, fall[place[led.best.trial.label]], least)]
        )
        mine = place[led.best.trial.label]
        felt = any(
            interact(one, mine, led.axis, fall) or interact(mine, one, axis, fall)
            for one, axis in leaders
        )
        enough = _least_fall(led.best, led.axis, round_.fitter, state, settings)
        if not felt and _earns_its_gain(round_.fitter, led.best, state.model, enough):
            leaders.append((mine, led.axis))
            found += named_simply(led, round_.fitter, state)
    if not found and round_.fitter.adds_up:
        found = _pairs(round_, trials, state, settings, tried)
    return tuple(found)


def best_fit_first(
    standings: Sequence[AxisPosterior], fall: Array, place: Mapping[str, int]
) -> list[AxisPosterior]:
    """Return posteriors in the order in which their leaders are added: the one whose fit leaves least comes first.

    Fits decide, since held-out losses also differ by what other logs tell of the own parameters, even on an axis that
    neither of two leaders moves. A leader of several axes comes with the axis where its held-out loss falls most.
    ``fall`` (n_trials, n_axes): that fall; ``place``: the row of a trial by label.
    """

    def left(s: AxisPosterior) -> tuple[float, float]:
        best = s.best.trial
        return best.fitted.total, -float(fall[place[best.label], s.axis])

    return sorted(standings, key=left)


def _beaten_at_home(led: AxisPosterior, causes: Mapping[int, AxisPosterior | None]) -> bool:
    """Whether the leader belongs to another axis, and a different effect of that axis leads there.

    The effect on other axes tells little about which effect of its own axis it is.
    """
    effect = led.best.trial.hypothesis.effect
    if effect.axis is None or effect.axis == led.axis + 1:
        return False
    home = causes.get(effect.axis - 1)
    if home is None:
        return False
    other = home.best.trial.hypothesis.effect
    return other.axis == effect.axis and other.label != effect.label


def _rival_leads(
    led: AxisPosterior,
    other: AxisPosterior,
    fall: Array,
    place: Mapping[str, int],
    state: SearchState,
    settings: Settings,
) -> bool:
    """Whether a rival of the leader, on the leader's own axis, surely leads another axis.

    It must lead there by more than the formula error of the leader and of the causes so far, and be likelier than
    *none* and *unknown*.
    """
    first, rival = led.best.trial, other.best.trial
    mine = first.hypothesis.effect.axis
    if other.axis == led.axis or mine is None or rival.hypothesis.effect.axis != mine:
        return False
    if rival is first or all(r.trial is not rival for r in led.ranked):
        return False
    if other.best.probability < other.p_none + other.p_unknown:
        return False
    more = fall[place[rival.label], other.axis] - fall[place[first.label], other.axis]
    formula = settings.model_error**2 * float(fall[place[first.label]].sum())
    formula += FORMULA_ERROR * float(state.removed()[other.axis])
    sure = state.layout.significance(first.held_out, rival.held_out, other.axis)
    return bool(more > formula and sure > settings.significance)


def _leads(led: AxisPosterior, other: AxisPosterior, fall: Array, least: Array) -> bool:
    """Whether the leader of one axis also leads another, by more than a cause must remove there."""
    same = other.best.trial is led.best.trial
    return other.axis != led.axis and same and bool(fall[other.axis] > least[other.axis])


def _pairs(
    round_: SearchRound,
    trials: Sequence[FittedHypothesis],
    state: SearchState,
    settings: Settings,
    tried: int,
) -> list[tuple[RankedHypothesis, AxisPosterior]]:
    """Return pairs of causes on axes where no single cause is significant and that do not affect each other."""
    first = state.layout.by_axis(held_out_loss(state.baseline) - state.floor)
    pairs = Pairs(
        round_.fitter, state.model, trials, round_.current, state.floor, state.layout, settings
    )
    found = [pairs.found(axis, float(first[axis]), tried) for axis in range(state.layout.n_axes)]
    seen = [p for p in found if p is not None and _each_allowed(p, state)]
    seen.sort(key=lambda p: -p.gain)
    fall = falls([p.both for p in seen], round_.current, state.layout)
    kept: list[int] = []
    for k, pair in enumerate(seen):
        felt = (interact(i, k, pair.axis, fall) or interact(k, i, seen[i].axis, fall) for i in kept)
        if not any(felt):
            kept.append(k)
    return [member for i in kept for member in seen[i].members]


def _led_by_a_cause(
    standing: AxisPosterior, fitter: ModelFitter, state: SearchState, settings: Settings, tried: int
) -> AxisPosterior | None:
    """Return the posterior led by its first candidate that is a cause and close to the leader; None if there is none.

    Candidates before it are not significant, or give way to what every machine has; they are taken out.
    """
    standing = ordinary_first(
        standing, fitter, lambda r: _is_cause(r, standing, fitter, state, settings, tried)
    )
    for k, r in enumerate(standing.ranked):
        near = r.score >= NEARLY * standing.best.score
        if near and _is_cause(r, standing, fitter, state, settings, tried):
            return standing.without_first(k)
    return None


def _least_fall(
    one: RankedHypothesis,
    axis: int,
    fitter: ModelFitter,
    state: SearchState,
    settings: Settings,
) -> float:
    """Return the least fall of the loss on an axis (from 0) for a cause.

    What every machine has and the simulator lacks may be small beside the other causes.
    """
    if is_lacked(one, axis, fitter):
        return settings.smallest_gain * float(state.layout.samples()[axis])
    return float(state.least_falls(settings)[axis])


def _is_cause(
    best: RankedHypothesis,
    standing: AxisPosterior,
    fitter: ModelFitter,
    state: SearchState,
    settings: Settings,
    tried: int,
) -> bool:
    """Whether a candidate explains enough of an axis, and significantly.

    The level keeps the false alarms of all ``tried`` candidates together at ``settings.false_alarms`` (Bonferroni).
    Each has two tests: its gain and its size. What every machine has and the simulator lacks is expected: the level is
    that of one candidate, and it may be small beside the other causes.
    """
    expected = is_lacked(best, standing.axis, fitter)
    all_tried = normal_deviate(settings.false_alarms / max(2 * tried, 1))
    alone = normal_deviate(settings.false_alarms / 2)
    needed = alone if expected else max(settings.significance, all_tried)
    fall = best.gain * float(state.layout.samples()[standing.axis])
    least = _least_fall(best, standing.axis, fitter, state, settings)
    large = fall > least and not state.mends(best.trial)
    worth = large and best.score > settings.smallest_score
    led = best.significance > needed and worth and standing.best.probability > standing.p_none
    return led and _allowed(best.trial, state)


def _allowed(one: FittedHypothesis, state: SearchState, beside: FittedModel | None = None) -> bool:
    """Whether an effect may be a cause, whatever the bodies of the arm where these are not trusted.

    ``beside``: the model without it, by default that of the state.
    """
    return state.bodies is None or state.bodies.allow(one, beside or state.model)


def _each_allowed(pair: Pair, state: SearchState) -> bool:
    """Whether each of a pair may be a cause beside the other."""
    each = zip(pair.members, pair.without, strict=True)
    return all(_allowed(one.trial, state, beside) for (one, _), beside in each)


def _take_in(
    round_: SearchRound,
    state: SearchState,
    taken: Sequence[tuple[RankedHypothesis, AxisPosterior]],
    progress: Progress,
) -> Diverged | None:
    """Add causes to the model; return how it diverges with them, else None."""
    label = "adding " + ", ".join(r.trial.label for r, _ in taken)
    progress(label, 0, 1)
    round_.fitter.work.stage = "adding"
    start = taken[0][0].trial.fitted
    # If only one of a pair fits in `max_causes`, its trial holds both: fit it again without the other.
    if len(taken) == 1 and len(start.free) <= len(state.model.free) + 1:
        free = list(start.free)
    else:
        free = list(state.model.free)
        for r, _ in taken:
            new = r.trial.fitted.free[-1]
            free = [*kept_beside(free, new), new]
    # Start from the first cause's fit, since a gap may have bent the simulator without it. Fit to the tolerance of the
    # last fit, since mostly this is the last one.
    found = settled(round_.fitter, free, start, rough=round_.rough, worth=OPEN)
    if isinstance(found, Diverged):
        return found
    state.moved("add", found)
    progress(label, 1, 1)
    return None


def _earns_its_gain(
    fitter: ModelFitter, winner: RankedHypothesis, model: FittedModel, least: float
) -> bool:
    """Whether the fit gains by the effect itself, not by moving the other parameters.

    The fit must gain enough against ``least``, the loss that a cause removes, and lose half of that when the effect is
    switched off. This rules out an effect that only helps an unfinished fit, or one that only improves predictions
    because own parameters took up a gap.
    """
    fitted = winner.trial.fitted
    others = [replace(f, free=()) for f in fitted.free[:-1]]
    gain = model.total - fitted.total
    if fitter.within_tolerance(fitted.effects[-1]) or gain < HOPELESS * least:
        return False
    without = fitter.evaluate(others, model, robot_values=fitted.robot_values)
    # A loop that swings without end lacks it.
    return isinstance(without, Diverged) or without.total - fitted.total > 0.5 * gain


def _settled(state: SearchState, settings: Settings) -> bool:
    """Whether every axis has less loss left than a cause would remove."""
    return bool(np.all(state.left() < state.least_falls(settings)))
