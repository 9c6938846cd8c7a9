"""Effects that the simulator states itself, and the machine has within the scatter of its type.

Dry friction of a machine is a few per cent off that of its simulator, as its viscous friction is. The re-fit makes up
for viscous friction. An effect is none of its parameters, and would be called a cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from axisight.effects import Effect, effect_info
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.settings import KNOWN_AS, Settings
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.likelihood import FORMULA_ERROR
from axisight.gap.search.state import SearchState
from axisight.robot import Robot

# Tolerances up to which a value is scatter, and those of what shapes a law, which logs tell less of.
_SCATTER, _OF_SHAPES = 3.0, 10.0


def with_scatter_taken(
    robot: Robot, found: SearchState, settings: Settings
) -> tuple[Robot, tuple[Finding, ...]]:
    """Return a simulator with the values found of effects that it states, where these are scatter.

    Causes are that, or explain no more than one that is. And a finding for each; none where there is none. An
    effect is known as well as viscous friction is.
    """
    tolerance = settings.tolerances_of(robot).get(KNOWN_AS, 0.0)
    fitted = [*_rivals(found), *zip(found.model.free, found.model.effects, strict=False)]
    taken = {e.label: (f, e) for f, e in fitted if _is_scatter(f, e, tolerance)}
    if not taken:
        return robot, ()
    effects = [taken[e.label][1] if e.label in taken else e for e in robot.effects]
    return robot.with_effects(effects), tuple(_told(f, e, tolerance) for f, e in taken.values())


def _rivals(found: SearchState) -> Iterator[tuple[Hypothesis, Effect]]:
    """Yield what explains as much as a cause, and its values: scatter is there before any cause is."""
    for winner, standing in found.accepted:
        for rival in standing.ranked:
            if rival.score >= winner.score - FORMULA_ERROR:
                yield rival.trial.hypothesis, rival.trial.fitted.effects[-1]


def _is_scatter(option: Hypothesis, fitted: Effect, tolerance: float) -> bool:
    """Whether an effect that the simulator states was found with nearly its values."""
    if not option.stated or option.effect.label != fitted.label:
        return False
    values = fitted.parameters or {}
    table = effect_info(fitted.name).parameters
    sizes = _sizes(fitted.name, option.stated)
    return bool(sizes) and all(
        abs(values.get(p.name, 0.0) - option.stated[p.name])
        <= (
            _SCATTER * tolerance * sizes.get(p.unit, 0.0)
            if p.role == "amplitude"
            else _OF_SHAPES * tolerance * (abs(option.stated[p.name]) or 1.0)
        )
        for p in table
        if p.name in option.free and "notation" not in p.marks
    )


def _sizes(name: str, stated: Mapping[str, float]) -> dict[str, float]:
    """Return the largest amplitude stated of each unit, where there is any."""
    out: dict[str, float] = {}
    for p in effect_info(name).parameters:
        if p.role == "amplitude" and stated.get(p.name):
            out[p.unit] = max(out.get(p.unit, 0.0), abs(stated[p.name]))
    return out


def _told(option: Hypothesis, fitted: Effect, tolerance: float) -> Finding:
    values, amplitudes = fitted.parameters or {}, _amplitudes(fitted.name)
    off = ", ".join(
        f"{name} {100 * (values[name] / option.stated[name] - 1):+.2g} %"
        for name in amplitudes
        if name in option.free and option.stated[name]
    )
    message = (
        f"{fitted.label}: {off} off what the simulator states. Within {100 * _SCATTER * tolerance:g} %, three of "
        f"the tolerance of {KNOWN_AS}, that is scatter of machines and no cause: the gap is counted with it."
    )
    return Finding("effect_within_scatter", "flag", message, axis=fitted.axis, field=fitted.name)


def _amplitudes(name: str) -> Sequence[str]:
    return [p.name for p in effect_info(name).parameters if p.role == "amplitude"]
