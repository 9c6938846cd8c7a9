"""More usual effects begun where the fit of a less usual one ended, which is them at its limits.

A soft middle of a gear without any stiffness is play: where the simulator is still far off, the
valley of the play is too narrow for its own start, and that of the soft middle leads into it.
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
    """Return the candidates more usual than ``leader``, with the shape that its fit found.

    Of ``options`` those that were not ``tried``, by label, and have a shape or size in common with it.
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
    """Return the labels of what is more usual than a leader, on its axis or of the arm."""
    effect = leader.hypothesis.effect
    usual = map(effect_info, effect_info(effect.name).usual)
    return {Effect(i.name, None if i.scope == "arm" else effect.axis).label for i in usual}


def ended_at_bound(one: FittedHypothesis) -> bool:
    """Whether a number of a candidate ended at its bound: at its limits a law may be the usual one."""
    last = len(one.fitted.effects) - 1
    return any(place == last for place, _ in one.fitted.ended_at_bound)


def in_common(fitted: Effect, info: EffectInfo) -> Mapping[str, float]:
    """Return the values of a fitted effect that another one takes, of the same quantity.

    That is one with a unit; the same name says so, or the same unit where only one parameter has it.
    """
    own = effect_info(fitted.name).parameters
    units = [p.unit for p in own]
    return {
        p.name: value
        for p in info.parameters
        for q, value in zip(own, fitted.values(), strict=True)
        if p.unit == q.unit != "1" and (p.name == q.name or units.count(q.unit) == 1)
    }
