"""Starts a common effect from the fit of a rarer one that includes it as a limit case.

Example: a gear with a soft middle of zero stiffness has backlash. While the simulator is far from the machine, the
minimum of backlash is too narrow for its own start values, but the fit of the soft middle leads into it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from axisight.effects import Effect, EffectInfo, effect_info
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.screening.screening import Start


def begun_where_it_ended(
    leader: FittedHypothesis, options: Sequence[Hypothesis], tried: Collection[str]
) -> list[Start]:
    """Return the common look-alikes of ``leader`` as candidates that start at the values of its fit.

    ``options``: all candidates; those whose label is in ``tried``, or that share no quantity with the leader, are left
    out.
    """
    fitted = leader.fitted.effects[-1]
    usual = effect_info(fitted.name).usual
    starts = []
    for option in options:
        effect = option.effect
        if effect.name in usual and effect.axis == fitted.axis and effect.label not in tried:
            shared = in_common(fitted, effect_info(effect.name))
            if shared:
                start = Start(option.at(shared), leader.fitted.robot_values, 0.0)
                starts.append(start)
    return starts


def more_usual(leader: FittedHypothesis) -> set[str]:
    """Return the labels of the common look-alikes of a leader, on its axis or of the arm."""
    effect = leader.hypothesis.effect
    usual = map(effect_info, effect_info(effect.name).usual)
    return {Effect(i.name, None if i.scope == "arm" else effect.axis).label for i in usual}


def ended_at_bound(one: FittedHypothesis) -> bool:
    """Whether a parameter of a candidate ended at its bound, where the law may equal a common look-alike."""
    last = len(one.fitted.effects) - 1
    return any(place == last for place, _ in one.fitted.ended_at_bound)


def in_common(fitted: Effect, info: EffectInfo) -> Mapping[str, float]:
    """Return the values of a fitted effect that another effect takes over, by parameter name.

    A parameter matches by the same name and unit. The same unit suffices if only one fitted parameter has it.
    Parameters without a unit never match.
    """
    own = effect_info(fitted.name).parameters
    units = [p.unit for p in own]
    return {
        p.name: value
        for p in info.parameters
        for q, value in zip(own, fitted.values(), strict=True)
        if p.unit == q.unit != "1" and (p.name == q.name or units.count(q.unit) == 1)
    }
