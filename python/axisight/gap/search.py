"""Search for causes: try all, take in the best of every axis, drop what is no longer needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.errors import InputError
from axisight.gap.decide import (
    FORMULA_ERROR,
    Ranked,
    Standing,
    Trial,
    clearly_worse,
    falls,
    without_composite,
)
from axisight.gap.edge import BENT, bent
from axisight.gap.evidence import Evidence, FreeEffect
from axisight.gap.jointly import Pairs, in_parts, without_rival_composites
from axisight.gap.kept import KeptColumns
from axisight.gap.layout import Layout, layout_of
from axisight.gap.merged import one_for_several
from axisight.gap.model import ModelFitter
from axisight.gap.score import held_out_loss, linear_gain, predictable
from axisight.gap.screening import kept_beside
from axisight.gap.sensitivity import Sensitivity
from axisight.gap.settings import Settings
from axisight.gap.swaps import alike, mending, nearly_as_good, straightened, weighed_again
from axisight.gap.trials import Progress, Trials, fresh, interact, settled
from axisight.statistics.tails import normal_deviate

Array = NDArray[np.float64]

# Loss that a step may still promise: half of it is a log-likelihood ratio.
_OPEN = 1.0
# Each round takes in a cause on every axis that has one; this many on top of one another are
# no longer causes but a shape.
_MOST_ROUNDS = 8


# What a law that mends another one leaves at most, of what that one does, where it is the right one.
_MENDED = 0.5


@dataclass(frozen=True)
class Round:
    """One round: how candidates stood on each axis, what was taken in.

    ``left`` (n_axes,): held-out loss above the floor before.
    """

    standings: tuple[Standing, ...]
    accepted: tuple[tuple[Ranked, Standing], ...]
    left: Array


@dataclass
class Search:
    """Result of a search.

    ``baseline``: the simulator re-fitted without effects; ``model``: with the
    accepted effects; ``floor`` (n_blocks,): loss of noise alone; ``layout``: where the
    blocks lie; ``skipped``: candidates that failed, with the reason;
    ``sensitivities`` by label, of candidates as they were screened last;
    ``adds_up``: errors add up axis by axis; ``by_axis``: the effects explain their axes, not the arm.
    """

    baseline: Evidence
    model: Evidence
    floor: Array
    layout: Layout
    rounds: list[Round] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    sensitivities: dict[str, Sensitivity] = field(default_factory=dict)
    adds_up: bool = False
    by_axis: bool = False

    @property
    def accepted(self) -> list[tuple[Ranked, Standing]]:
        """The causes in the model and how they stood when they entered, in the model's order."""
        entered = {r.trial.label: (r, s) for x in self.rounds for r, s in x.accepted}
        return [entered[f.effect.label] for f in self.model.free]

    def to_explain(self) -> Array:
        """Return the held-out loss of the re-fitted simulator above the floor, by axis (n_axes,)."""
        used = predictable(self.model)
        above = held_out_loss(self.baseline, like=self.model) - self.floor
        return self.layout.by_axis(np.where(used, above, 0.0))

    def left(self) -> Array:
        """Return the held-out loss of the model above the floor, by axis (n_axes,)."""
        return self.left_by(self.model)

    def left_by(self, model: Evidence) -> Array:
        """Return the same of another model."""
        return self.layout.by_axis(held_out_loss(model) - self.floor)

    def removed(self) -> Array:
        """Return how much of it the causes remove, by axis (n_axes,)."""
        used = predictable(self.model)
        fall = held_out_loss(self.baseline, like=self.model) - held_out_loss(self.model)
        return self.layout.by_axis(np.where(used, fall, 0.0))

    def least_falls(self, settings: Settings) -> Array:
        """Return the fall of the loss of each axis (n_axes,) below which nothing there is a cause.

        In a loop, where errors do not add up axis by axis, what a cause on one axis takes away
        leaves the error of its formula on every other.
        """
        formulas = 0.0 if self.adds_up else settings.model_error**2 * float(self.removed().sum())
        return np.maximum(
            settings.smallest_gain * self.layout.samples() + formulas,
            settings.smallest_share * self.to_explain(),
        )

    def mends(self, one: Trial) -> bool:
        """Whether a trial mends the formula of a cause: it is another law of the same gear, or of its dry friction.

        One that takes away no more on its own axis than what formulas may leave of what was removed there.
        """
        axis = one.candidate.effect.axis
        others = [
            e for e in self.model.effects if e.axis == axis and alike(e, one.candidate.effect)
        ]
        if self.adds_up or axis is None or not others:
            return False
        fall = self.layout.by_axis(held_out_loss(self.model) - one.held_out)
        return bool(fall[axis - 1] < FORMULA_ERROR * self.removed()[axis - 1])

    def explained(self) -> float:
        """Return the share of the explainable held-out error the model removes."""
        total = float(self.to_explain().sum())
        return float(self.removed().sum()) / total if total > 0 else 0.0


def search(
    fitter: ModelFitter,
    candidates: Callable[[Evidence], list[FreeEffect]],
    expected: Array,
    settings: Settings,
    progress: Progress,
) -> Search:
    """Search for the causes of a gap.

    ``candidates`` makes the candidates from the residual of a model;
    ``expected`` (n_axes,) is the mean square of a weighted residual of noise.
    """
    progress("re-fitting the simulator", 0, 1)
    baseline = _refitted(fitter)
    progress("re-fitting the simulator", 1, 1)
    floor = expected[baseline.axis] * baseline.samples
    out = Search(baseline, baseline, floor, layout_of(baseline), adds_up=fitter.adds_up)
    refused: set[str] = set()
    kept = KeptColumns()

    def offered_beside(model: Evidence) -> list[FreeEffect]:
        return fresh(candidates(model), model, refused)

    for number in range(1, _MOST_ROUNDS + 1):
        least = out.least_falls(settings)
        round_ = Trials(
            fitter,
            out.model,
            floor,
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
        trials = round_.refined(round_.run(options, number), options, number)
        standings, taken = _judged(round_, trials, out, settings, len(options))
        if round_.first(standings, trials) not in {r.trial.label for r, _ in taken}:
            # What others waited for is no cause.
            trials = round_.run_waiting(trials, options, number)
            trials = round_.refined(trials, options, number, even_felt=True)
            standings, taken = _judged(round_, trials, out, settings, len(options))
        out.skipped |= round_.skipped
        out.sensitivities |= round_.sensitivities
        out.rounds.append(Round(standings, taken, out.left()))
        if not taken:
            break
        try:
            _take_in(round_, out, taken, progress)
        except InputError as error:
            # Together they cannot be simulated: what promised most was none of it.
            refused.add(taken[0][0].trial.label)
            out.skipped[taken[0][0].trial.label] = str(error)
            continue
        refused |= _drop_idle(fitter, out, settings)
        refused |= _merge(fitter, out, settings, offered)
        if _settled(out, settings) or len(out.model.free) >= settings.max_causes:
            break
    if not fitter.adds_up:
        _weigh_again(fitter, out, settings)
    _straighten(fitter, out)
    if not fitter.adds_up:
        _withdraw_doubtful(fitter, out, settings)
    _finish(fitter, out)
    return out


def _refitted(fitter: ModelFitter) -> Evidence:
    """Return the simulator re-fitted without effects: most of the way on the first halves of the logs."""
    halves = fitter.beginnings()
    if halves is None:
        return fitter.fit([], refreshes=1)
    return fitter.fit([], halves.fit([]))


def _judged(
    round_: Trials, trials: Sequence[Trial], state: Search, settings: Settings, tried: int
) -> tuple[tuple[Standing, ...], tuple[tuple[Ranked, Standing], ...]]:
    """Return how the trials stand on every axis, and what is taken in, as room permits."""
    standings = tuple(round_.standings(trials))
    taken = _taken(round_, trials, standings, state, settings, tried)
    room = settings.max_causes - len(state.model.free)
    return standings, taken[: max(room, 0)]


def _taken(
    round_: Trials,
    trials: Sequence[Trial],
    standings: Sequence[Standing],
    state: Search,
    settings: Settings,
    tried: int,
) -> tuple[tuple[Ranked, Standing], ...]:
    """Return the winners of all axes that are causes and do not feel one another."""
    fall = falls(trials, round_.current, state.layout)
    place = {t.label: i for i, t in enumerate(trials)}
    found: list[tuple[Ranked, Standing]] = []
    leaders: list[tuple[int, int]] = []

    def felt_most(s: Standing) -> tuple[float, float]:
        # One that leads on several axes is judged where it gains most.
        mine = fall[place[s.best.trial.label]]
        return -float(mine.sum()), -float(mine[s.axis])

    causes = {s.axis: _led_by_a_cause(s, state, settings, tried) for s in standings}
    for standing in sorted(standings, key=felt_most):
        led = causes[standing.axis]
        if led is None or _beaten_at_home(led, causes):
            continue
        led = led.with_those_that_lead(
            [s for s in standings if _rival_leads(led, s, fall, place, state, settings)]
        )
        least = state.least_falls(settings)
        led = led.with_what_others_say(
            [s for s in standings if _leads(led, s, fall[place[led.best.trial.label]], least)]
        )
        mine = place[led.best.trial.label]
        felt = any(
            interact(one, mine, led.axis, fall) or interact(mine, one, axis, fall)
            for one, axis in leaders
        )
        if not felt and _earns_its_gain(round_.fitter, led.best, state.model):
            leaders.append((mine, led.axis))
            found += _named_simply(led, round_.fitter, state)
    if not found and round_.fitter.adds_up:
        found = _pairs(round_, trials, state, settings, tried)
    return tuple(found)


def _beaten_at_home(led: Standing, causes: Mapping[int, Standing | None]) -> bool:
    """Whether another cause leads on the axis of what leads elsewhere, and is of that axis too.

    How effects of one axis fare on others says little of which of them it is.
    """
    effect = led.best.trial.candidate.effect
    if effect.axis is None or effect.axis == led.axis + 1:
        return False
    home = causes.get(effect.axis - 1)
    if home is None:
        return False
    other = home.best.trial.candidate.effect
    return other.axis == effect.axis and other.label != effect.label


def _rival_leads(
    led: Standing,
    other: Standing,
    fall: Array,
    place: Mapping[str, int],
    state: Search,
    settings: Settings,
) -> bool:
    """Whether a rival of what leads a standing, of the same axis, surely leads another one.

    By more than what the formula of the first may leave there.
    """
    first, rival = led.best.trial, other.best.trial
    mine = first.candidate.effect.axis
    if other.axis == led.axis or mine is None or rival.candidate.effect.axis != mine:
        return False
    if rival is first or all(r.trial is not rival for r in led.ranked):
        return False
    more = fall[place[rival.label], other.axis] - fall[place[first.label], other.axis]
    formula = settings.model_error**2 * float(fall[place[first.label]].sum())
    sure = state.layout.significance(first.held_out, rival.held_out, other.axis)
    return bool(more > formula and sure > settings.significance)


def _leads(led: Standing, other: Standing, fall: Array, least: Array) -> bool:
    """Whether what leads a standing also leads another, by what a cause takes away there."""
    same = other.best.trial is led.best.trial
    return other.axis != led.axis and same and bool(fall[other.axis] > least[other.axis])


def _named_simply(
    led: Standing, fitter: ModelFitter, state: Search
) -> Sequence[tuple[Ranked, Standing]]:
    """Return the cause that leads a standing, or what it is made of where that does as well."""
    if fitter.adds_up:
        whole = without_rival_composites(led)
        return in_parts(led, fitter, state.model, state.layout) or ((whole.best, whole),)
    simpler = _simpler(led, fitter)
    return ((simpler.best, simpler),)


def _pairs(
    round_: Trials, trials: Sequence[Trial], state: Search, settings: Settings, tried: int
) -> list[tuple[Ranked, Standing]]:
    """Return the pairs of causes, on axes that do not feel one another, where none shows alone."""
    first = state.layout.by_axis(held_out_loss(state.baseline) - state.floor)
    pairs = Pairs(round_.fitter, trials, round_.current, state.floor, state.layout, settings)
    found = [pairs.found(axis, float(first[axis]), tried) for axis in range(state.layout.n_axes)]
    seen = sorted((p for p in found if p is not None), key=lambda p: -p.gain)
    fall = falls([p.both for p in seen], round_.current, state.layout)
    kept: list[int] = []
    for k, pair in enumerate(seen):
        felt = (interact(i, k, pair.axis, fall) or interact(k, i, seen[i].axis, fall) for i in kept)
        if not any(felt):
            kept.append(k)
    return [member for i in kept for member in seen[i].members]


# Of candidates that explain nearly as much as the first, one may show more evenly over time.
_NEARLY = 0.8


def _led_by_a_cause(
    standing: Standing, state: Search, settings: Settings, tried: int
) -> Standing | None:
    """Return the standing led by its first candidate that is a cause, not far behind the winner.

    Those before it, which the data do not show evenly enough to be causes, are no rivals.
    """
    for k, r in enumerate(standing.ranked):
        near = r.score >= _NEARLY * standing.best.score
        if near and _is_cause(r, standing, state, settings, tried):
            return standing.without_first(k)
    return None


def _is_cause(
    best: Ranked, standing: Standing, state: Search, settings: Settings, tried: int
) -> bool:
    """Whether what a candidate explains on an axis is real and worth naming.

    It is one of ``tried`` candidates, each with two chances (its gain and its size): its
    significance is held against the level that keeps the false alarms of all of them together at
    ``settings.false_alarms`` (Bonferroni).
    """
    needed = max(
        settings.significance,
        normal_deviate(settings.false_alarms / max(2 * tried, 1)),
    )
    fall = best.gain * float(state.layout.samples()[standing.axis])
    least = float(state.least_falls(settings)[standing.axis])
    large = fall > least and not state.mends(best.trial)
    worth = large and best.score > settings.smallest_score
    return best.significance > needed and worth and standing.best.probability > standing.p_none


def _take_in(
    round_: Trials,
    state: Search,
    taken: Sequence[tuple[Ranked, Standing]],
    progress: Progress,
) -> None:
    label = "adding " + ", ".join(r.trial.label for r, _ in taken)
    progress(label, 0, 1)
    start = taken[0][0].trial.evidence
    # One of a pair that the count of causes has no room for was fitted beside the other.
    if len(taken) == 1 and len(start.free) <= len(state.model.free) + 1:
        free = list(start.free)
    else:
        free = list(state.model.free)
        for r, _ in taken:
            new = r.trial.evidence.free[-1]
            free = [*kept_beside(free, new), new]
    # From the simulator of the first: a gap may have bent the one without it. As far as the last fit
    # goes: mostly this is it.
    state.model = settled(round_.fitter, free, start, rough=round_.rough, worth=_OPEN)
    progress(label, 1, 1)


def _straighten(fitter: ModelFitter, state: Search) -> None:
    """Put a rival in the place of a cause that holds only with a bent simulator."""
    if bent(fitter, state.model) < BENT:
        return
    labels = {f.effect.label for f in state.model.free}
    entered = [
        (r, x.standings) for x in state.rounds for r, _ in x.accepted if r.trial.label in labels
    ]
    found = straightened(fitter, state.model, entered)
    if found is not None:
        state.model, _, rival = found
        state.rounds.append(Round((rival[1],), (rival,), state.left()))


# Steps of the last fit.
_FINISHING = 12


def _finish(fitter: ModelFitter, state: Search) -> None:
    """Fit on where a step still promises more than noise leaves open.

    A share of a large loss, at which fits end, may be many standard deviations along a flat valley, such
    as that of a load and the mass of the link that carries it.
    """
    model = state.model
    if not model.free or model.stuck or linear_gain(model) < _OPEN:
        return
    with suppress(InputError):
        state.model = fitter.fit(
            model.free, model, lazy=True, max_iterations=_FINISHING, refreshes=1, worth=_OPEN
        )


def _weigh_again(fitter: ModelFitter, state: Search, settings: Settings) -> None:
    """Judge causes anew that came in beside others which turned out to be none, or that another law mends."""
    final = {f.effect.label for f in state.model.free}
    last = state.rounds[-1].standings
    for cause, standing in state.accepted:
        mended = {f.effect.label for f in cause.trial.evidence.free} <= final
        found = weighed_again(
            fitter,
            state.model,
            cause,
            standing,
            state.floor,
            state.layout,
            settings.explained_share,
            mending(cause, last) if mended else nearly_as_good(state.model, cause, standing),
        )
        if found is None:
            continue
        left, axis = state.left(), standing.axis
        if not mended or state.left_by(found[0])[axis] < _MENDED * left[axis]:
            state.model, taken = found
            state.rounds.append(Round((taken[1],), (taken,), left))


def _drop_idle(fitter: ModelFitter, state: Search, settings: Settings) -> set[str]:
    """Drop the effects that others have made needless; return their labels."""
    dropped: set[str] = set()
    samples = state.layout.samples()
    while len(state.model.free) > 1:
        free = state.model.free
        gains = []
        for i, f in enumerate(free):
            others = [*free[:i], *free[i + 1 :]]
            try:
                without = fitter.evaluate(
                    others, state.model, robot_values=state.model.robot_values
                )
            except InputError:
                # A loop that swings without end lacks it.
                gains.append(np.inf)
                continue
            left = without.total - linear_gain(without) - state.model.total
            worth = samples[f.effect.axis - 1] if f.effect.axis else samples.min()
            gains.append(left / float(worth))
        worst = int(np.argmin(gains))
        if gains[worst] > settings.smallest_gain:
            break
        dropped.add(free[worst].effect.label)
        rest = [*free[:worst], *free[worst + 1 :]]
        state.model = settled(fitter, rest, state.model)
    return dropped


def _withdraw_doubtful(fitter: ModelFitter, state: Search, settings: Settings) -> None:
    """Take out the causes that something unknown is likelier than, and stays so.

    One that explains a small part of its axis is a cause if others explain the rest. Where the rest
    is still there in the end, both are rather parts of something that no effect stands for.
    """
    now = state.left()
    doubtful = {
        r.trial.label
        for x in state.rounds
        for r, s in x.accepted
        if s.p_unknown > r.probability
        and x.left[s.axis] - now[s.axis] < settings.explained_share * x.left[s.axis]
    }
    kept = [f for f in state.model.free if f.effect.label not in doubtful]
    if len(kept) < len(state.model.free):
        state.model = settled(fitter, kept, state.model)


def _merge(
    fitter: ModelFitter, state: Search, settings: Settings, options: Sequence[FreeEffect]
) -> set[str]:
    """Put one effect in the place of several that it does as well as; return their labels."""
    gone: set[str] = set()
    while found := one_for_several(
        fitter, state.model, options, state.floor, state.layout, settings
    ):
        evidence = found[0].trial.evidence
        left, now = {f.effect.label for f in state.model.free}, {e.label for e in evidence.effects}
        gone |= left - now
        taken = _as_it_stood(found, left - now, state)
        before = state.left()
        state.model = settled(fitter, evidence.free, evidence)
        state.rounds.append(Round((taken[1],), (taken,), before))
    return gone


def _as_it_stood(
    found: tuple[Ranked, Standing], gone: set[str], state: Search
) -> tuple[Ranked, Standing]:
    """Return what takes the place of one cause as it stood beside that; there it had all its rivals."""
    for cause, standing in state.accepted if len(gone) == 1 else ():
        if cause.trial.label in gone:
            same = [r for r in standing.inseparable() if r.trial.label == found[0].trial.label]
            return (same[0], standing.led_by(same[0])) if same else found
    return found


def _first_part(standing: Standing) -> Ranked | None:
    """Return the rival that is the first part of a winner which simpler effects imitate."""
    effect = standing.best.trial.candidate.effect
    parts = effect_info(effect.name).parts
    if not parts:
        return None
    label = Effect(parts[0], effect.axis).label
    return next((r for r in standing.ranked if r.trial.label == label), None)


def _simpler(standing: Standing, fitter: ModelFitter) -> Standing:
    """Return a standing led by the first part of a composite winner, where parts do nearly as well or better.

    Where the first does nearly as well alone, the composite stays a rival. Where it takes both parts, one cause is
    likelier than two: it has to leave clearly more than they do.
    """
    part = _first_part(standing)
    if part is None:
        return standing
    if any(r is part for r in standing.inseparable()):
        return standing.led_by(part)
    winner = standing.best
    effect = winner.trial.candidate.effect
    second = effect_info(effect.name).parts[1]
    other = FreeEffect(Effect(second, effect.axis), (effect_info(second).parameters[0].name,))
    try:
        both = fitter.fit([*part.trial.evidence.free, other], part.trial.evidence, lazy=True)
    except InputError:
        return standing
    if clearly_worse(float(winner.trial.held_out.sum()), float(held_out_loss(both).sum())):
        return without_composite(standing, part)
    return standing


def _earns_its_gain(fitter: ModelFitter, winner: Ranked, model: Evidence) -> bool:
    """Whether the gain goes away when the effect is switched off again.

    A fit with one more effect also moves everything else; where the model was not
    at its optimum, that may be all it did.
    """
    fitted = winner.trial.evidence
    others = [replace(f, free=()) for f in fitted.free[:-1]]
    if fitter.within_tolerance(fitted.effects[-1]):
        return False
    try:
        without = fitter.evaluate(others, model, robot_values=fitted.robot_values)
    except InputError:
        # A loop that swings without end lacks it.
        return True
    return without.total - fitted.total > 0.5 * (model.total - fitted.total)


def _settled(state: Search, settings: Settings) -> bool:
    """Whether what is left on every axis is less than any cause would take away."""
    return bool(np.all(state.left() < state.least_falls(settings)))
