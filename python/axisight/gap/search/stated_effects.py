"""Effects that the simulator states, with values that differ only by the scatter between machines.

Dry friction of a machine differs by a few per cent from its simulator, as viscous friction does. The re-fit adjusts
viscous friction, but not effects. Without this step, such a difference would be named a cause.
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

# Deviation up to which an amplitude is scatter, and a shape parameter, which logs tell less about [tolerances].
_SCATTER, _OF_SHAPES = 3.0, 10.0


def with_scatter_taken(
    robot: Robot, found: SearchState, settings: Settings
) -> tuple[Robot, tuple[Finding, ...]]:
    """Return the simulator with the found values of its stated effects where these are scatter, and a finding for each.

    The tolerance of an effect is that of viscous friction. Without scatter: the robot as given, and no finding.
    """
    tolerance = settings.tolerances_of(robot).get(KNOWN_AS, 0.0)
    fitted = [*_rivals(found), *zip(found.model.free, found.model.effects, strict=False)]
    taken = {e.label: (f, e) for f, e in fitted if _is_scatter(f, e, tolerance)}
    if not taken:
        return robot, ()
    effects = [taken[e.label][1] if e.label in taken else e for e in robot.effects]
    return robot.with_effects(effects), tuple(_told(f, e, tolerance) for f, e in taken.values())


def _rivals(found: SearchState) -> Iterator[tuple[Hypothesis, Effect]]:
    """Yield candidates that explain as much as a cause, with their values, since scatter is likelier than a cause."""
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
        f"{fitted.label}: the logs say {off} off the simulator's value. Up to {100 * _SCATTER * tolerance:g} % "
        f"(three tolerances of {KNOWN_AS}) is scatter between machines and no cause. The gap is counted with the "
        "logs' value"
    )
    return Finding("effect_within_scatter", "flag", message, axis=fitted.axis, field=fitted.name)


def _amplitudes(name: str) -> Sequence[str]:
    return [p.name for p in effect_info(name).parameters if p.role == "amplitude"]
