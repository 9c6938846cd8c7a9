"""From a search to a verdict in words: none, explained, unknown or undecidable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from axisight.effects import Effect, effect_info
from axisight.gap.advice import separating_experiment
from axisight.gap.decide import Ranked, inseparable
from axisight.gap.model import Evidence
from axisight.gap.result import Candidate, Cause, Gap, Interval, VerdictKind, Where
from axisight.gap.score import held_out_loss
from axisight.gap.search import Search
from axisight.gap.settings import Settings


@dataclass(frozen=True)
class NamedCause:
    """A cause before its effect on the validation logs is measured."""

    effect: str
    axis: int | None
    probability: float
    parameters: dict[str, Interval]
    units: dict[str, str]


@dataclass(frozen=True)
class Conclusion:
    """What the estimation logs say."""

    verdict: VerdictKind
    causes: tuple[NamedCause, ...]
    alternatives: tuple[Candidate, ...]
    equivalent: tuple[tuple[str, ...], ...]
    next_experiment: str | None
    ranking: tuple[Candidate, ...]
    checks: tuple[str, ...]

    def headline(
        self,
        gap: Gap,
        causes: Sequence[Cause],
        where: Sequence[Where],
        own: Sequence[Effect] = (),
    ) -> str:
        """Return the finding in one or two plain sentences; ``own``: effects of the simulator."""
        if self.verdict == "none":
            return (
                f"No unmodelled effect found: the simulator, re-fitted within its tolerances, leaves "
                f"{_percent(gap.refitted)} of the torque unexplained; sensor noise alone leaves {_percent(gap.floor)}."
            )
        place = f" The gap lies mainly on axis {where[0].axis}." if where else ""
        if self.verdict == "unknown":
            return (
                f"The simulator misses something that no known effect explains well: "
                f"{_percent(gap.before)} of the torque is unexplained, {_percent(gap.floor)} would be noise.{place}"
            )
        present = {(e.name, e.axis) for e in own if e.acts}
        named = " and ".join(
            ("the machine's values of " if (c.effect, c.axis) in present else "")
            + _spoken(c.effect, c.axis)
            for c in causes
        )
        shrinks = (
            f"adding it shrinks the gap on held-out data from {_percent(gap.before)} to {_percent(gap.after)} "
            f"of the torque (noise alone: {_percent(gap.floor)})."
        )
        if self.verdict == "undecidable":
            rivals = " or ".join(label for label in self.equivalent[0])
            return f"This data cannot tell {rivals} apart: with the first of them, {shrinks}"
        return f"The simulator lacks {named}: {shrinks}"


def conclude(found: Search, settings: Settings, *, stands_out: bool) -> Conclusion:
    """Draw the verdict from a finished search.

    ``stands_out``: whether the plain torque error of the re-fitted simulator lies
    above the noise; without, what no effect explains is taken for noise.
    """
    accepted = found.accepted
    explained = found.explained()
    first = found.rounds[0].ranked
    ranking = tuple(_candidate(r, found.rounds[0].accepted is not None) for r in first)
    checks = _checks(found, settings, explained)
    if not accepted:
        verdict: VerdictKind = "unknown" if stands_out and _significant(found, settings) else "none"
        advice = _advice_unknown() if verdict == "unknown" else None
        return Conclusion(verdict, (), ranking[:5], (), advice, ranking, checks)
    if explained < settings.explained_share:
        return Conclusion("unknown", (), ranking[:5], (), _advice_unknown(), ranking, checks)
    groups = [inseparable(r.ranked) for r in found.rounds if r.accepted is not None]
    open_groups = tuple(tuple(r.trial.label for r in g) for g in groups if len(g) > 1)
    causes = tuple(_named(r, i, found.model) for i, r in enumerate(accepted))
    verdict = "undecidable" if open_groups else "explained"
    labels = {c.trial.label for c in accepted}
    alternatives = tuple(c for c in ranking if c.label not in labels)[:5]
    advice = separating_experiment(open_groups[0]) if open_groups else None
    return Conclusion(verdict, causes, alternatives, open_groups, advice, ranking, checks)


def _significant(found: Search, settings: Settings) -> bool:
    """Whether the re-fitted simulator leaves more than floor and formula error."""
    excess = held_out_loss(found.baseline) - found.floor
    return float(excess.sum() / found.baseline.size.sum()) > settings.largest_scatter


def _candidate(ranked: Ranked, any_accepted: bool) -> Candidate:
    effect = ranked.trial.candidate.effect
    return Candidate(
        effect.name,
        effect.axis,
        # Without an accepted cause, the probabilities say only which would be least bad.
        ranked.probability if any_accepted else 0.0,
        ranked.score,
        ranked.significance,
        ranked.trial.evidence.status,
    )


def _named(ranked: Ranked, position: int, model: Evidence) -> NamedCause:
    effect = model.effects[position]
    values = effect.parameters or {}
    info = effect_info(effect.name)
    intervals = {}
    for name in model.free[position].free:
        spread = 1.96 * model.std.get((position, name), 0.0)
        intervals[name] = Interval(values[name], values[name] - spread, values[name] + spread)
    for p in info.parameters:
        # Orders of a ripple are chosen, not fitted.
        if p.name.startswith("order_") and values.get(p.name):
            intervals[p.name] = Interval(values[p.name], values[p.name], values[p.name])
    units = {p.name: p.unit for p in info.parameters}
    return NamedCause(effect.name, effect.axis, ranked.probability, intervals, units)


def _checks(found: Search, settings: Settings, explained: float) -> tuple[str, ...]:
    tried = sum(len(r.ranked) for r in found.rounds)
    before = held_out_loss(found.baseline)
    size = float(found.baseline.size.sum())
    left = float((held_out_loss(found.model) - found.floor).sum()) / size
    out = [
        f"{tried} fits of candidate effects compared over {len(found.rounds)} rounds on data left out of each fit.",
        f"Mean square of the weighted residual above the floor: {(before - found.floor).sum() / size:.3f} "
        f"re-fitted, {left:.3f} with the causes (1 is noise plus {100 * settings.model_error:g} % model error).",
        f"Share of the explainable error removed on held-out estimation data: {100 * explained:.1f} %.",
    ]
    out += [f"Candidate {k} could not be tried: {v}" for k, v in sorted(found.skipped.items())]
    bound = [n for e, n in found.model.at_bound if e is None]
    if bound:
        out.append(f"On the edge of their tolerance after the fit: {', '.join(bound)}.")
    return tuple(out)


def _advice_unknown() -> str:
    return (
        "Look at the gap map for the axis, band and regime of the residual; record a run that "
        "repeats the same motion twice, to tell a repeatable effect from a disturbance in time."
    )


def _percent(x: float) -> str:
    return f"{100 * x:.3g} %"


def _spoken(effect: str, axis: int | None) -> str:
    words = effect.replace("_", " ")
    return words if axis is None else f"{words} on axis {axis}"
